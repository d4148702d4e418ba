"""Whether a stimulated unit holds headings as precisely as a trained command.

The paper's experiment on control precision (section 4): the same headings are held by a PID that sets a
command which the policy was trained to follow, and by a PID that sets the output of a hidden unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.confidence_intervals import PairedRatio, paired_ratio
from pdtui.core.errors import MapError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.disturbance_conditions import find_condition, plan_pushes
from pdtui.evaluation.target_tracking import find_pid_behaviors
from pdtui.paper.pid_outputs import ControlInput, classify_pid_outputs, list_pid_outputs
from pdtui.search.gains.tracking_drives import (
    STEPS_EACH,
    STEPS_UNTOUCHED,
    TrackingDriveJob,
    TrackingDriveResult,
    TrackingDriveRunner,
)
from pdtui.search.gains.tracking_summary import (
    HEADINGS,
    TrackingSummary,
    mean_errors_by_seed,
    summarize_tracking,
)
from pdtui.stimulation.stimulation_map import Behavior

ATTRIBUTE = "yaw"
PUSHED_SEEDS = 10
"""Largest number of seeds that are also run with pushes."""


@dataclass(frozen=True)
class PushedHeadingResult:
    """What one behavior does on the first seeds while the robot is pushed.

    Attributes:
        ratio: its error over that of the behavior by command, pushed equally; None for that one.
    """

    tracking: TrackingSummary
    ratio: PairedRatio | None


@dataclass(frozen=True)
class HeadingControllerResult:
    """The result of one behavior that holds the heading.

    Attributes:
        input_kind: whether the PID sets commands, units, interventions, or several of these.
        inputs: names of the commands and units that it sets, and what its interventions do.
        other_commands: the commands that it leaves alone, and their values.
        ratio: its error over that of the map's behavior by command; None for that one, and without one.
        pushed: the same while the robot is pushed; None if not measured.
        headings: heading per seed and control step, rad, shape (seeds, targets × 100); NaN after a fall.
    """

    map: str
    robot: str
    policy: str
    input_kind: ControlInput
    inputs: tuple[str, ...]
    other_commands: dict[str, float]
    tracking: TrackingSummary
    ratio: PairedRatio | None
    headings: Floats
    pushed: PushedHeadingResult | None = None


@dataclass(frozen=True)
class HeadingPrecisionComparison:
    """The result of the experiment.

    Attributes:
        seeds: seeds of the drives, the same for all behaviors.
        targets: target headings in the order in which they are set, rad.
        dt: duration of a control step, s.
        rows: results by map, then in the order of its behaviors.
    """

    seeds: tuple[int, ...]
    targets: tuple[float, ...]
    dt: float
    rows: tuple[HeadingControllerResult, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        left_out = ("default_error", "default_outcomes")  # the experiment drives no robot without control
        rows = [
            {
                "map": row.map,
                "robot": row.robot,
                "policy": row.policy,
                "by": row.input_kind,
                "driven": list(row.inputs),
                "commands": row.other_commands,
                **{name: value for name, value in asdict(row.tracking).items() if name not in left_out},
                "ratio": None if row.ratio is None else asdict(row.ratio),
                "pushed": None if row.pushed is None else asdict(row.pushed),
            }
            for row in self.rows
        ]
        return {
            "experiment": "tracking",
            "seeds": list(self.seeds),
            "targets": list(self.targets),
            "steps_each": STEPS_EACH,
            "rows": rows,
        }


def compare_heading_precision(
    configs: Sequence[DriveConfig],
    seeds: Sequence[int],
    *,
    targets: Sequence[float] = HEADINGS,
    pushed: bool = False,
    workers: Workers = 1,
    progress: StepProgress | None = None,
) -> HeadingPrecisionComparison:
    """Hold headings with every behavior of the maps that has a PID on the yaw angle.

    The targets, in rad, are held for 100 control steps each. The seeds of the configurations are not used.
    With pushes, the first `PUSHED_SEEDS` seeds are run again under the evaluation's condition ``pushed``.

    Raises:
        MapError: a map has no such behavior, or the robots' control steps differ in duration.
        RobotError: a robot cannot be pushed.
        PdtuiError: a robot, policy or map cannot be loaded.
    """
    found = [(config, find_pid_behaviors(config, ATTRIBUTE)) for config in configs]
    again = seeds[:PUSHED_SEEDS] if pushed else ()
    total = (len(seeds) + len(again)) * sum(len(behaviors) for _, behaviors in found)
    rows: list[HeadingControllerResult] = []
    steps: dict[str, float] = {}
    done = 0

    def tell(here: int, _: int) -> None:
        if progress is not None:
            progress(done + here, total)

    for config, behaviors in found:
        with TrackingDriveRunner(config, workers) as runner:
            dt = steps[config.stimulation_map.source] = runner.loop.robot.control_dt
            length = STEPS_UNTOUCHED + STEPS_EACH * len(targets)
            pushes = {seed: plan_pushes(find_condition("pushed"), seed, dt, length) for seed in again}
            jobs = [TrackingDriveJob(ATTRIBUTE, "", seed, tuple(targets)) for seed in seeds]
            shoved = [replace(job, pushes=pushes[job.seed]) for job in jobs if job.seed in pushes]
            parts = []
            for each in (jobs, shoved) if pushed else (jobs,):
                of_all = [replace(job, behavior=one.name) for one in behaviors for job in each]
                parts.append(_split(runner.run(of_all, tell), len(behaviors)))
                done += len(of_all)
            rows += _rows(runner, behaviors, *parts)
    if len(set(steps.values())) > 1:
        told = ", ".join(f"{source} has {dt:g} s" for source, dt in steps.items())
        raise MapError(f"expected robots whose control steps are equally long, found: {told}")
    return HeadingPrecisionComparison(tuple(seeds), tuple(targets), next(iter(steps.values())), tuple(rows))


_DrivesOfBehaviors = Sequence[Sequence[TrackingDriveResult]]


def _split(results: Sequence[TrackingDriveResult], parts: int) -> _DrivesOfBehaviors:
    count = len(results) // parts
    return [results[part * count :][:count] for part in range(parts)]


def _rows(
    runner: TrackingDriveRunner,
    behaviors: Sequence[Behavior],
    drives: _DrivesOfBehaviors,
    pushed: _DrivesOfBehaviors | None = None,
) -> list[HeadingControllerResult]:
    loop, unit = runner.loop, runner.attribute(ATTRIBUTE).unit
    ratios = _ratios(behaviors, drives)
    shoved: list[PushedHeadingResult | None] = [None] * len(behaviors)
    if pushed is not None:
        shoved = [
            PushedHeadingResult(summarize_tracking(part, unit), ratio)
            for part, ratio in zip(pushed, _ratios(behaviors, pushed), strict=True)
        ]
    return [
        HeadingControllerResult(
            loop.map.source,
            loop.robot.name,
            loop.policy.name,
            classify_pid_outputs(behavior),
            list_pid_outputs(behavior, loop.map),
            {name: value for name, value in loop.robot.commands.items() if name not in behavior.commands},
            summarize_tracking(drives[number], unit),
            ratios[number],
            np.array([one.values.ravel() for one in drives[number]]),
            shoved[number],
        )
        for number, behavior in enumerate(behaviors)
    ]


def _ratios(behaviors: Sequence[Behavior], drives: _DrivesOfBehaviors) -> list[PairedRatio | None]:
    """Return the ratio of each behavior's error to that of the first one by command."""
    of_command = [
        part for one, part in zip(behaviors, drives, strict=True) if classify_pid_outputs(one) == "command"
    ]
    return [
        None if not of_command or part is of_command[0] else paired_error_ratio(part, of_command[0])
        for part in drives
    ]


def paired_error_ratio(
    units: Sequence[TrackingDriveResult], command: Sequence[TrackingDriveResult]
) -> PairedRatio:
    """Return the ratio of mean |error| over the seeds on which both drives reached the first target."""
    above, below = mean_errors_by_seed(units), mean_errors_by_seed(command)
    both = np.isfinite(above) & np.isfinite(below)
    return paired_ratio(above[both], below[both])
