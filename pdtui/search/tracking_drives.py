"""Drives that follow targets: one behavior of mode ``pid``, one seed, one target after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pdtui.core.angles import wrap_angle, wrap_angles
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.closable import Closable
from pdtui.core.events import Event
from pdtui.core.worker_pool import WorkerPool
from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.drive_config import DriveConfig
from pdtui.drive.loop_builder import build_loop
from pdtui.search.step_response import StepResponse, measure_step_response
from pdtui.stimulation.stimulation_map import PidGains

STEPS_UNTOUCHED = 100
"""Control steps that the policy walks by itself before the first target."""
STEPS_EACH = 100
"""Control steps that every target is held."""


@dataclass(frozen=True)
class TrackingDrive:
    """One drive.

    Attributes:
        attribute: what is to follow.
        behavior: the one that holds it; empty leaves the policy alone.
        seed: of the reset.
        targets: in the attribute's unit.
        pid: other gains than the map's; None for those.
    """

    attribute: str
    behavior: str
    seed: int
    targets: tuple[float, ...]
    pid: PidGains | None = None


@dataclass(frozen=True)
class TrackingDriveResult:
    """How a drive went.

    Attributes:
        drive: it.
        values: the attribute after each control step by target, shape (targets, `STEPS_EACH`); NaN after a
            fall. An angle does not jump at ±π.
        errors: target − value, the shorter way round for an angle; of the same shape.
        responses: to every step of the target; the first target is none.
        fell: whether the robot fell.
    """

    drive: TrackingDrive
    values: Floats
    errors: Floats
    responses: tuple[StepResponse, ...]
    fell: bool

    @property
    def error(self) -> float:
        """Mean |error| until the end or the fall; NaN for a robot that fell before the first target."""
        known = np.abs(self.errors[np.isfinite(self.errors)])
        return float(known.mean()) if known.size else float("nan")


class TrackingDriveRunner(Closable):
    """Runs drives on one robot and policy; with one worker in this process, else in others.

    The results do not depend on the number of workers: each drive begins with a reset from its seed.

    Args:
        config: robot, map and policy, or a loop of them, which stays in this process; the seed is not used.
        workers: processes, started by the first call of `run`.

    Raises:
        PdtuiError: robot, policy or map cannot be had.
    """

    def __init__(self, config: DriveConfig | ControlLoop, workers: int = 1) -> None:
        self.loop = build_loop(config) if isinstance(config, DriveConfig) else config
        workers = workers if isinstance(config, DriveConfig) else 1
        name = f"drives of {self.loop.robot.name}"
        self._pool = WorkerPool(name, workers, self.loop, build_loop, config)

    def close(self) -> None:
        """End the processes; a later `run` starts new ones."""
        self._pool.close()

    def attribute(self, name: str) -> Attribute:
        """The attribute of a name.

        Raises:
            RobotError: the robot has none.
        """
        return self.loop.robot.attributes[self.loop.robot.attribute_index(name)]

    def run(
        self, drives: Sequence[TrackingDrive], progress: Callable[[int, int], None] | None = None
    ) -> list[TrackingDriveResult]:
        """Drive them all; results in their order.

        Args:
            drives: what to drive.
            progress: called with the number of drives finished and of all drives.

        Raises:
            WorkerError: a worker process died.
        """
        return self._pool.map(drive_targets, drives, progress)


def drive_targets(built: ControlLoop, drive: TrackingDrive) -> TrackingDriveResult:
    """Drive once; the loop given stays as it is but for its robot's and policy's state."""
    wanted = built.map
    if drive.pid is not None:
        changed = replace(wanted.behaviors[drive.behavior], pid=drive.pid)
        wanted = replace(wanted, behaviors={**wanted.behaviors, drive.behavior: changed})
    loop = ControlLoop(built.robot, built.policy, wanted, drive.seed)
    column = built.robot.attribute_index(drive.attribute)
    path = np.full(1 + len(drive.targets) * STEPS_EACH, np.nan)
    for _ in range(STEPS_UNTOUCHED):
        record = loop.advance()
        if record.ended:
            break
    fell = record.fell
    if not record.ended:
        path[0] = loop.attributes[column]
        for number in range(len(path) - 1):
            record = loop.advance(_events(loop.step, drive, number))
            path[number + 1] = record.attributes[column]
            fell = record.fell
            if record.ended:
                break
    return _summed_up(drive, path, fell, built.robot.attributes[column].wraps, built.robot.control_dt)


def _events(step: int, drive: TrackingDrive, number: int) -> list[Event]:
    """What happens before a control step, counted from the first target."""
    if not drive.behavior or number % STEPS_EACH:
        return []
    target = Event(step, "target", drive.behavior, drive.targets[number // STEPS_EACH])
    return [Event(step, "behavior", drive.behavior), target] if number == 0 else [target]


def _summed_up(drive: TrackingDrive, path: Floats, fell: bool, wraps: bool, dt: float) -> TrackingDriveResult:
    smooth = np.unwrap(path) if wraps else path
    values = smooth[1:].reshape(len(drive.targets), STEPS_EACH)
    errors = np.array(drive.targets)[:, None] - values
    if wraps:
        errors = wrap_angles(errors)
    responses = []
    for row in range(1, len(drive.targets)):
        step, start = drive.targets[row] - drive.targets[row - 1], float(values[row - 1, -1])
        if step == 0.0 or np.isnan(start):
            continue
        way = drive.targets[row] - start
        aim = start + (wrap_angle(way) if wraps else way)
        responses.append(measure_step_response(start, values[row], aim, step, dt))
    return TrackingDriveResult(drive, values, errors, tuple(responses), fell)
