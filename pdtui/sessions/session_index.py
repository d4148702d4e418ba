"""What the index at the end of a session contains: all but the data of its control steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import Any

from pdtui.core.drive_events import DriveEvent


def encode_session_index(
    drive: Mapping[str, Any],
    versions: Mapping[str, str],
    *,
    steps: int,
    events: Sequence[DriveEvent],
    endings: Mapping[int, str],
    outcome: str,
    gaps: Sequence[tuple[int, int]] = (),
) -> dict[str, Any]:
    """Return the index of a session as plain data.

    Args:
        drive: the properties of the drive, as `encode_drive_info` returns them.
        versions: versions of the machine and the libraries.
        steps: number of control steps.
        events: the events, in the order in which they were applied.
        endings: why episodes ended by themselves, by the control step that ended each.
        outcome: how the drive ended.
        gaps: ranges of control steps that a repair could not rescue, without their ends.
    """
    return {
        "drive": dict(drive),
        "versions": dict(versions),
        "steps": steps,
        "events": [list(astuple(event)) for event in events],
        "endings": [[step, reason] for step, reason in endings.items()],
        "outcome": outcome,
        "gaps": [list(gap) for gap in gaps],
    }
