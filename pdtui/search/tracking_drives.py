"""Drives in which a behavior of mode ``pid`` tracks one target after another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pdtui.core.attributes import Attribute, Floats, wrap_angle, wrap_angles
from pdtui.core.closable import Closable
from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome
from pdtui.core.processes.worker_pool import WorkerPool
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.search.step_response import StepResponse, measure_step_response
from pdtui.stimulation.stimulation_map import PidGains

STEPS_UNTOUCHED = 100
"""Control steps without stimulation before the first target."""
STEPS_EACH = 100
"""Control steps per target."""


@dataclass(frozen=True)
class TrackingDriveJob:
    """One drive to run.

    Attributes:
        attribute: name of the attribute to track.
        behavior: name of the behavior that holds it; empty for no stimulation.
        seed: seed of the reset.
        targets: targets, in the attribute's unit.
        pid: gains to use instead of the map's; None for the map's.
        pushes: changes of vx and vy of the trunk, m/s, by the control step before which they come.
    """

    attribute: str
    behavior: str
    seed: int
    targets: tuple[float, ...]
    pid: PidGains | None = None
    pushes: Mapping[int, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class TrackingDriveResult:
    """The result of one drive.

    Attributes:
        drive: the drive.
        values: the attribute after each control step, shape (targets, `STEPS_EACH`), with angles unwrapped;
            NaN after the end of the episode.
        errors: target − value, the shorter way round for an angle, of the same shape.
        responses: responses to each step of the target, of which the first target is none.
        outcome: how the episode ended, or that the robot arrived; None if it lasted to the end of the drive.
    """

    drive: TrackingDriveJob
    values: Floats
    errors: Floats
    responses: tuple[StepResponse, ...]
    outcome: Outcome | None

    @property
    def error(self) -> float:
        """Mean |error| until the end; NaN if the episode ended before the first target."""
        known = np.abs(self.errors[np.isfinite(self.errors)])
        return float(known.mean()) if known.size else float("nan")


class TrackingDriveRunner(Closable):
    """Runs drives of one robot and policy, in this process or in worker processes.

    Each drive begins with a reset from its seed, so the results do not depend on the number of workers.

    Args:
        config: robot, map and policy, or a loop of them, which stays in this process; its seed is not used.
        workers: number of processes; the first call of `run` starts them.

    Raises:
        PdtuiError: the robot, the policy or the map cannot be loaded.
    """

    def __init__(self, config: DriveConfig | ControlLoop, workers: int = 1) -> None:
        self.loop = build_control_loop(config) if isinstance(config, DriveConfig) else config
        workers = workers if isinstance(config, DriveConfig) else 1
        name = f"drives of {self.loop.robot.name}"
        self._pool = WorkerPool(name, workers, self.loop, build_control_loop, config)

    def close(self) -> None:
        """End the processes; a later `run` starts new ones."""
        self._pool.close()

    def attribute(self, name: str) -> Attribute:
        """Return the attribute of this name.

        Raises:
            RobotError: the robot has no such attribute.
        """
        return self.loop.robot.attributes[self.loop.robot.attribute_index(name)]

    def run(
        self, drives: Sequence[TrackingDriveJob], progress: Callable[[int, int], None] | None = None
    ) -> list[TrackingDriveResult]:
        """Run all drives, and return the results in their order.

        Args:
            drives: the drives.
            progress: called with (drives done, drives).

        Raises:
            WorkerError: a worker process died.
        """
        return self._pool.map(drive_through_targets, drives, progress)


def drive_through_targets(template: ControlLoop, drive: TrackingDriveJob) -> TrackingDriveResult:
    """Run one drive; of the loop given, only the state of its robot and policy changes."""
    stimulation_map = template.map
    if drive.pid is not None:
        changed = replace(stimulation_map.behaviors[drive.behavior], pid=drive.pid)
        stimulation_map = replace(
            stimulation_map, behaviors={**stimulation_map.behaviors, drive.behavior: changed}
        )
    loop = ControlLoop(template.robot, template.policy, stimulation_map, drive.seed)
    column = template.robot.attribute_index(drive.attribute)
    path = np.full(1 + len(drive.targets) * STEPS_EACH, np.nan)

    def advance(events: Sequence[DriveEvent] = ()) -> StepRecord:
        if loop.step in drive.pushes:
            loop.robot.push_trunk(*drive.pushes[loop.step])
        return loop.advance(events)

    for _ in range(STEPS_UNTOUCHED):
        record = advance()
        if record.ended:
            break
    outcome = record.outcome
    if not record.ended:
        path[0] = loop.attributes[column]
        for number in range(len(path) - 1):
            record = advance(_events(loop.step, drive, number))
            path[number + 1] = record.attributes[column]
            outcome = record.outcome or outcome
            if record.ended:
                break
    return _summarize(
        drive, path, outcome, template.robot.attributes[column].wraps, template.robot.control_dt
    )


def _events(step: int, drive: TrackingDriveJob, number: int) -> list[DriveEvent]:
    """Return the events before a control step, which counts from the first target."""
    if not drive.behavior or number % STEPS_EACH:
        return []
    target = DriveEvent(step, "target", drive.behavior, drive.targets[number // STEPS_EACH])
    return [DriveEvent(step, "behavior", drive.behavior), target] if number == 0 else [target]


def _summarize(
    drive: TrackingDriveJob, path: Floats, outcome: Outcome | None, wraps: bool, dt: float
) -> TrackingDriveResult:
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
    return TrackingDriveResult(drive, values, errors, tuple(responses), outcome)
