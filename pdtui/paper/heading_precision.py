"""Whether a stimulated unit holds headings as precisely as a trained command.

The paper's experiment on control precision (section 4): the same headings are held by a PID that sets a
command which the policy was trained to follow, and by a PID that sets the output of a hidden unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import PairedRatio, paired_ratio
from pdtui.core.errors import MapError
from pdtui.core.worker_pool import StepProgress
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.target_tracking import find_pid_behaviors
from pdtui.search.tracking_drives import (
    STEPS_EACH,
    TrackingDriveJob,
    TrackingDriveResult,
    TrackingDriveRunner,
)
from pdtui.search.tracking_summary import HEADINGS, TrackingSummary, mean_errors_by_seed, summarise_tracking
from pdtui.stimulation.stimulation_map import Behavior

ATTRIBUTE = "yaw"
ControlInput = Literal["command", "units", "both"]


@dataclass(frozen=True)
class HeadingControllerResult:
    """The result of one behavior that holds the heading.

    Attributes:
        input_kind: whether the PID sets commands, units or both.
        inputs: names of the commands and units that it sets.
        other_commands: the commands that it leaves alone, and their values.
        ratio: its error over that of the map's behavior by command; None for that one, and without one.
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
        rows = [
            {
                "map": row.map,
                "robot": row.robot,
                "policy": row.policy,
                "by": row.input_kind,
                "driven": list(row.inputs),
                "commands": row.other_commands,
                **{name: value for name, value in asdict(row.tracking).items() if name != "default_error"},
                "ratio": None if row.ratio is None else asdict(row.ratio),
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


def describe_pid_output(behavior: Behavior) -> ControlInput:
    """Return what the PID of a behavior sets."""
    if behavior.commands and behavior.magnitudes:
        return "both"
    return "command" if behavior.commands else "units"


def compare_heading_precision(
    configs: Sequence[DriveConfig],
    seeds: Sequence[int],
    *,
    targets: Sequence[float] = HEADINGS,
    workers: int = 1,
    progress: StepProgress | None = None,
) -> HeadingPrecisionComparison:
    """Hold headings with every behavior of the maps that has a PID on the yaw angle.

    The targets, in rad, are held for 100 control steps each. The seeds of the configurations are not used.

    Raises:
        MapError: a map has no such behavior, or the robots' control steps differ in duration.
        PdtuiError: a robot, policy or map cannot be loaded.
    """
    found = [(config, find_pid_behaviors(config, ATTRIBUTE)) for config in configs]
    total, before = len(seeds) * sum(len(behaviors) for _, behaviors in found), 0
    rows: list[HeadingControllerResult] = []
    steps: dict[str, float] = {}
    for config, behaviors in found:

        def tell(done: int, _: int, before: int = before) -> None:
            if progress is not None:
                progress(before + done, total)

        with TrackingDriveRunner(config, workers) as runner:
            steps[config.stimulation_map.source] = runner.loop.robot.control_dt
            drives = [
                TrackingDriveJob(ATTRIBUTE, one.name, seed, tuple(targets))
                for one in behaviors
                for seed in seeds
            ]
            rows += _rows(runner, behaviors, runner.run(drives, tell))
        before += len(seeds) * len(behaviors)
    if len(set(steps.values())) > 1:
        told = ", ".join(f"{source} has {dt:g} s" for source, dt in steps.items())
        raise MapError(f"expected robots whose control steps are equally long, found: {told}")
    return HeadingPrecisionComparison(tuple(seeds), tuple(targets), next(iter(steps.values())), tuple(rows))


def _rows(
    runner: TrackingDriveRunner, behaviors: Sequence[Behavior], followed: Sequence[TrackingDriveResult]
) -> list[HeadingControllerResult]:
    loop, count = runner.loop, len(followed) // len(behaviors)
    parts = [list(followed[number * count :][:count]) for number in range(len(behaviors))]
    command = next(
        (p for b, p in zip(behaviors, parts, strict=True) if describe_pid_output(b) == "command"), None
    )
    return [
        HeadingControllerResult(
            loop.map.source,
            loop.robot.name,
            loop.policy.name,
            describe_pid_output(behavior),
            (*behavior.commands, *loop.map.units_of(behavior)),
            {name: value for name, value in loop.robot.commands.items() if name not in behavior.commands},
            summarise_tracking(part, runner.attribute(ATTRIBUTE).unit),
            None if command is None or part is command else paired_error_ratio(part, command),
            np.array([one.values.ravel() for one in part]),
        )
        for behavior, part in zip(behaviors, parts, strict=True)
    ]


def paired_error_ratio(
    units: Sequence[TrackingDriveResult], command: Sequence[TrackingDriveResult]
) -> PairedRatio:
    """Return the ratio of mean |error| over the seeds on which both drives reached the first target."""
    above, below = mean_errors_by_seed(units), mean_errors_by_seed(command)
    both = np.isfinite(above) & np.isfinite(below)
    return paired_ratio(above[both], below[both])
