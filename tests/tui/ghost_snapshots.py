"""A recorded drive with a ghost beside it: the same drive, some time earlier."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pdtui.driving.drive_snapshot import DriveSnapshot, KeyPress
from pdtui.driving.ghost.ghost_snapshot import GhostPose, GhostSnapshot

DELAY = 12
"""Snapshots by which the ghost's numbers are older than the drive's."""


def with_ghost(snapshots: list[DriveSnapshot], since: int) -> list[DriveSnapshot]:
    """Return the snapshots with a ghost from the one with index `since` on, and a key where it begins."""
    seen: list[DriveSnapshot] = []
    first = snapshots[since].step - len(snapshots[since].history)
    for index, snapshot in enumerate(snapshots):
        if index < since:
            seen.append(replace(snapshot, ghost=GhostSnapshot("waiting")))
            continue
        older = snapshots[index - DELAY]
        rows = len(snapshot.history)
        ghost = GhostSnapshot(
            "running",
            first=first,
            latest=GhostPose(snapshot.step, older.attributes, snapshot.attributes, older.poses),
            history=np.resize(older.history, (rows, snapshot.history.shape[1])),
            path=np.resize(older.path[:, :2], (rows, 2)),
        )
        keys = (KeyPress(first, "a", 1),) if index == since else ()
        seen.append(replace(snapshot, ghost=ghost, key_presses=keys))
    return seen
