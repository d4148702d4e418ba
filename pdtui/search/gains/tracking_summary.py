"""How precisely a behavior holds its targets: figures over tracking drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import confidence_interval
from pdtui.core.errors import MapError
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.search.gains.step_response import StepResponseSummary
from pdtui.search.gains.tracking_drives import TrackingDriveJob, TrackingDriveResult, TrackingDriveRunner
from pdtui.stimulation.stimulation_map import Behavior

HEADINGS = (0.0, 0.4, 0.9, 1.2, 0.9, 0.4, 0.0, -0.4, -0.9, -1.2, -0.9, -0.4, 0.0)
"""The paper's targets of an angle, rad."""
SETTLED = 25
"""Last control steps at a target, by which the attribute should have settled."""
_PART = 0.1
"""Step of the targets, as a share of the attribute's natural value."""
_SIZES = (0, 1, 2, 1, 0, -1, -2, -1, 0)


@dataclass(frozen=True)
class TargetErrorSummary:
    """Mean |error| at one target over all its control steps and over the last 25, and their bias."""

    target: float
    error: float
    settled: float
    bias: float


@dataclass(frozen=True)
class TrackingSummary:
    """How well a behavior tracks its targets. A drive counts until its end.

    Attributes:
        behavior: name of the behavior of mode ``pid``.
        attribute, unit: the attribute that it holds.
        seeds: seeds of the drives.
        targets: errors at each target, in the order in which the targets were set; none if these differ
            between seeds.
        error, low, high: mean |error| over seeds with its 95 % interval.
        settled: mean |error| over the last 25 steps of each target.
        bias: |mean error| over these steps, in which the swing within a stride averages out; mean over
            targets and seeds.
        responses: rise time and overshoot over all steps of the target and all seeds.
        outcomes: how drives ended before their time, and on how many seeds.
        default_error: mean |error| without the controller at the same targets; None if not measured.
        default_outcomes: how the drives without the controller ended before their time; empty as well.
    """

    behavior: str
    attribute: str
    unit: str
    seeds: tuple[int, ...]
    targets: tuple[TargetErrorSummary, ...]
    error: float
    low: float
    high: float
    settled: float
    bias: float
    responses: StepResponseSummary
    outcomes: OutcomeCounts
    default_error: float | None = None
    default_outcomes: OutcomeCounts = field(default_factory=dict)


def summarize_tracking(
    results: Sequence[TrackingDriveResult], unit: str, untouched: Sequence[TrackingDriveResult] = ()
) -> TrackingSummary:
    """Summarize drives of one behavior, one per seed, beside the `untouched`: those without a controller."""
    drive = results[0].drive
    common = drive.targets if len({one.drive.targets for one in results}) == 1 else ()
    errors = np.array([one.errors for one in results])
    table, biases = np.abs(errors), np.abs(errors[:, :, -SETTLED:].mean(axis=2))
    means = mean_errors_by_seed(results)
    low, high = confidence_interval(means[np.isfinite(means)])
    return TrackingSummary(
        drive.behavior,
        drive.attribute,
        unit,
        tuple(one.drive.seed for one in results),
        tuple(
            TargetErrorSummary(
                target,
                mean_of_finite(table[:, row]),
                mean_of_finite(table[:, row, -SETTLED:]),
                mean_of_finite(biases[:, row]),
            )
            for row, target in enumerate(common)
        ),
        mean_of_finite(means),
        low,
        high,
        mean_of_finite(table[:, :, -SETTLED:]),
        mean_of_finite(biases),
        StepResponseSummary.of([response for one in results for response in one.responses]),
        count_outcomes((one.outcome for one in results), [Outcome.FELL]),
        mean_of_finite(mean_errors_by_seed(untouched)) if untouched else None,
        count_outcomes((one.outcome for one in untouched), [Outcome.FELL]) if untouched else {},
    )


def mean_errors_by_seed(results: Sequence[TrackingDriveResult]) -> Floats:
    """Return the mean |error| of each drive, shape (seeds,); NaN for an end before the first target."""
    return np.array([one.error for one in results])


def mean_of_finite(values: Floats) -> float:
    """Return the mean of the finite values, NaN if there are none."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def choose_tracking_targets(
    runner: TrackingDriveRunner, behavior: Behavior, seeds: Sequence[int]
) -> tuple[float, ...]:
    """Choose targets: the paper's headings for an angle, steps about its natural value for anything else.

    The natural value is the mean without stimulation. A step is a tenth of it, but at least one press
    of an arrow key.

    Args:
        runner: runs the drives without stimulation.
        behavior: the behavior that holds the attribute.
        seeds: seeds of these drives.
    """
    assert behavior.pid is not None
    name = behavior.pid.attribute
    if runner.attribute(name).wraps:
        return HEADINGS
    untouched = runner.run([TrackingDriveJob(name, "", seed, (0.0, 0.0)) for seed in seeds])
    natural = mean_of_finite(np.array([one.values for one in untouched]))
    if not np.isfinite(natural):
        raise MapError(
            f"behavior '{behavior.name}': expected targets near the value without stimulation, but the robot "
            f"ends its episode before the first one on seeds {list(seeds)}"
        )
    size = max(_PART * abs(natural), behavior.pid.step)
    return tuple(float(f"{natural + count * size:.4g}") for count in _SIZES)
