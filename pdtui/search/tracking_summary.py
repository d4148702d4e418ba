"""How precisely a target is held: figures of drives that follow targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.core.intervals import confidence_interval
from pdtui.search.step_response import StepResponseSummary
from pdtui.search.tracking_drives import TrackingDrive, TrackingDriveResult, TrackingDriveRunner
from pdtui.stimulation.stimulation_map import Behavior

HEADINGS = (0.0, 0.4, 0.9, 1.2, 0.9, 0.4, 0.0, -0.4, -0.9, -1.2, -0.9, -0.4, 0.0)
"""Targets of an angle, rad: the paper's."""


SETTLED = 25


_PART = 0.1


_SIZES = (0, 1, 2, 1, 0, -1, -2, -1, 0)


@dataclass(frozen=True)
class TargetErrorSummary:
    """Errors at one target, over all seeds: mean of |error| over its steps, and over the last 25 of them."""

    target: float
    error: float
    settled: float


@dataclass(frozen=True)
class TrackingSummary:
    """How well a target is held. A drive counts until its end or its fall.

    Attributes:
        behavior: the behavior of mode ``pid``.
        attribute, unit: what it holds.
        seeds: of the drives.
        targets: in the order in which they were set.
        error, low, high: mean |error| over seeds with its 95 % interval.
        settled: the same over the last 25 steps of each target.
        responses: rise time and overshoot over all steps of the target and all seeds.
        falls: seeds on which the robot fell.
        default_error: mean |error| without the controller, on the same targets; None where not measured.
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
    responses: StepResponseSummary
    falls: int
    default_error: float | None = None


def summarise_tracking(
    followed: Sequence[TrackingDriveResult], unit: str, default_error: float | None = None
) -> TrackingSummary:
    """Figures of one behavior's drives, one a seed, all to the same targets."""
    drive = followed[0].drive
    table = np.abs(np.array([one.errors for one in followed]))
    means = seed_errors(followed)
    low, high = confidence_interval(means[np.isfinite(means)])
    return TrackingSummary(
        drive.behavior,
        drive.attribute,
        unit,
        tuple(one.drive.seed for one in followed),
        tuple(
            TargetErrorSummary(target, finite_mean(table[:, row]), finite_mean(table[:, row, -SETTLED:]))
            for row, target in enumerate(drive.targets)
        ),
        finite_mean(means),
        low,
        high,
        finite_mean(table[:, :, -SETTLED:]),
        StepResponseSummary.of([response for one in followed for response in one.responses]),
        sum(one.fell for one in followed),
        default_error,
    )


def seed_errors(followed: Sequence[TrackingDriveResult]) -> Floats:
    """Mean |error| of each drive, shape (seeds,); NaN for one that fell before the first target."""
    return np.array([one.error for one in followed])


def finite_mean(values: Floats) -> float:
    """Mean of what is no NaN; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def choose_tracking_targets(
    runner: TrackingDriveRunner, behavior: Behavior, seeds: Sequence[int]
) -> tuple[float, ...]:
    """Targets that fit an attribute: the paper's headings for an angle, else steps about its natural value.

    A step is a tenth of what the attribute is when nobody touches the policy, and no less than one press of
    an arrow key.

    Args:
        runner: drive untouched to measure that.
        behavior: holds the attribute.
        seeds: of these drives.
    """
    assert behavior.pid is not None
    name = behavior.pid.attribute
    if runner.attribute(name).wraps:
        return HEADINGS
    untouched = runner.run([TrackingDrive(name, "", seed, (0.0, 0.0)) for seed in seeds])
    natural = finite_mean(np.array([one.values for one in untouched]))
    if not np.isfinite(natural):
        raise MapError(f"behavior '{behavior.name}': the robot fell untouched on seeds {list(seeds)}")
    size = max(_PART * abs(natural), behavior.pid.step)
    return tuple(float(f"{natural + count * size:.4g}") for count in _SIZES)
