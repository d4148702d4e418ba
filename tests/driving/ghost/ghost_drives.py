"""A drive that runs as fast as it can beside its ghost, which is in a process of its own."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_runner import GhostRunner
from pdtui.driving.ghost.ghost_snapshot import GhostCondition, GhostSnapshot
from pdtui.driving.headless_drive import events_of_pressed_keys
from pdtui.driving.loop_builder import build_control_loop

PATIENCE = 120.0


class GhostDrive:
    """A drive with its ghost, and what was read of both.

    Args:
        config: the drive; its ghost is off.
    """

    def __init__(self, config: DriveConfig) -> None:
        self.loop = build_control_loop(config)
        self.tracker = GhostRunner(config, self.loop)
        self.events: list[DriveEvent] = []
        self.digests: list[int] = []
        self.ghost_rows: list[Floats] = []
        """Attributes of all ghosts, in order, each shape (J,)."""
        self.ghost_path: list[Floats] = []

    def run(self, steps: int, *keys: str) -> None:
        """Press keys, then run control steps."""
        pressed = events_of_pressed_keys(keys, self.loop)
        self.events += pressed
        for _ in range(steps):
            record = self.loop.advance(pressed)
            self.digests.append(record.digest)
            self.tracker.add_step(record)
            pressed = []

    def look(self) -> GhostSnapshot | None:
        """Read the ghost."""
        ghost = self.tracker.build_snapshot()
        if ghost is not None and ghost.history is not None and ghost.path is not None:
            self.ghost_rows += list(ghost.history)
            self.ghost_path += list(ghost.path)
        return ghost

    def wait(self, wanted: Callable[[GhostSnapshot], bool]) -> GhostSnapshot:
        """Read the ghost until it is as wanted."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            ghost = self.look()
            if ghost is not None and wanted(ghost):
                return ghost
            time.sleep(0.01)
        raise AssertionError(f"the ghost did not become as wanted in {PATIENCE:g} s: {ghost}")

    def wait_for(self, condition: GhostCondition) -> GhostSnapshot:
        """Read the ghost until it is in a condition."""
        return self.wait(lambda ghost: ghost.condition == condition)

    def catch_up(self) -> GhostSnapshot:
        """Wait until the ghost has done every step of the drive."""
        return self.wait(lambda ghost: ghost.latest is not None and ghost.latest.step == self.loop.step)


@contextmanager
def ghost_drive(config: DriveConfig) -> Iterator[GhostDrive]:
    """A drive whose ghost has been turned on, and is off again at the end."""
    drive = GhostDrive(config)
    try:
        drive.tracker.toggle()
        yield drive
    finally:
        drive.tracker.close()
        drive.loop.robot.close()


def run_without_behaviors(config: DriveConfig, events: list[DriveEvent], steps: int) -> tuple[Floats, Floats]:
    """Attributes (S, J) and paths (S, 2) of a drive in which no behavior was ever latched."""
    loop = build_control_loop(config)
    rows, places = [], []
    for step in range(steps):
        record = loop.advance([one for one in events if one.step == step and one.kind != "behavior"])
        rows.append(record.attributes)
        places += [record.poses[0, :2]] if len(record.poses) else []
    loop.robot.close()
    return np.array(rows), np.array(places)
