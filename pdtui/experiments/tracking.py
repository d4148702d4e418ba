"""`pdtui evaluate --target yaw`: how precisely a PID holds an attribute, any that a map can hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.errors import MapError
from pdtui.experiments.evaluate import confidence_interval
from pdtui.experiments.following import Drive, Followed, Followers
from pdtui.experiments.response import Responses
from pdtui.robots.types import Floats
from pdtui.stimulation.maps import Behavior
from pdtui.teleop.order import DriveOrder

HEADINGS = (0.0, 0.4, 0.9, 1.2, 0.9, 0.4, 0.0, -0.4, -0.9, -1.2, -0.9, -0.4, 0.0)
"""Targets of an angle, rad: the paper's."""
SETTLED = 25
_PART = 0.1
_SIZES = (0, 1, 2, 1, 0, -1, -2, -1, 0)


@dataclass(frozen=True)
class TargetError:
    """Errors at one target, over all seeds: mean of |error| over its steps, and over the last 25 of them."""

    target: float
    error: float
    settled: float


@dataclass(frozen=True)
class Tracking:
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
    targets: tuple[TargetError, ...]
    error: float
    low: float
    high: float
    settled: float
    responses: Responses
    falls: int
    default_error: float | None = None


def evaluate_tracking(
    order: DriveOrder,
    attribute: str,
    seeds: Sequence[int],
    *,
    targets: Sequence[float] = (),
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Tracking:
    """Set the targets one after the other, 100 control steps each, on every seed; and once without control.

    Args:
        order: robot, map and policy; its seed is not used.
        attribute: what is to be held.
        seeds: of the resets.
        targets: in the attribute's unit; empty takes `targets_of`.
        workers: processes.
        progress: called with drives done and drives in all.

    Raises:
        MapError: the map has no behavior of mode ``pid`` for the attribute.
        PdtuiError: robot or policy cannot be had.
    """
    behavior = held_by(order, attribute)
    with Followers(order, workers) as followers:
        targets = tuple(targets) or targets_of(followers, behavior, seeds[:3])
        drives = [
            Drive(attribute, name, seed, tuple(targets)) for name in (behavior.name, "") for seed in seeds
        ]
        total = len(drives)
        followed = followers.run(drives, progress and (lambda done: progress(done, total)))
        unit = followers.attribute(attribute).unit
    untouched = known_mean(seed_errors(followed[len(seeds) :]))
    return summarise(followed[: len(seeds)], unit, untouched)


def summarise(followed: Sequence[Followed], unit: str, default_error: float | None = None) -> Tracking:
    """Figures of one behavior's drives, one a seed, all to the same targets."""
    drive = followed[0].drive
    table = np.abs(np.array([one.errors for one in followed]))
    means = seed_errors(followed)
    low, high = confidence_interval(means[np.isfinite(means)])
    return Tracking(
        drive.behavior,
        drive.attribute,
        unit,
        tuple(one.drive.seed for one in followed),
        tuple(
            TargetError(target, known_mean(table[:, row]), known_mean(table[:, row, -SETTLED:]))
            for row, target in enumerate(drive.targets)
        ),
        known_mean(means),
        low,
        high,
        known_mean(table[:, :, -SETTLED:]),
        Responses.of([response for one in followed for response in one.responses]),
        sum(one.fell for one in followed),
        default_error,
    )


def seed_errors(followed: Sequence[Followed]) -> Floats:
    """Mean |error| of each drive, shape (seeds,); NaN for one that fell before the first target."""
    return np.array([one.error for one in followed])


def known_mean(values: Floats) -> float:
    """Mean of what is no NaN; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def targets_of(followers: Followers, behavior: Behavior, seeds: Sequence[int]) -> tuple[float, ...]:
    """Targets that fit an attribute: the paper's headings for an angle, else steps about its natural value.

    A step is a tenth of what the attribute is when nobody touches the policy, and no less than one press of
    an arrow key.

    Args:
        followers: drive untouched to measure that.
        behavior: holds the attribute.
        seeds: of these drives.
    """
    assert behavior.pid is not None
    name = behavior.pid.attribute
    if followers.attribute(name).wraps:
        return HEADINGS
    untouched = followers.run([Drive(name, "", seed, (0.0, 0.0)) for seed in seeds])
    natural = known_mean(np.array([one.values for one in untouched]))
    if not np.isfinite(natural):
        raise MapError(f"behavior '{behavior.name}': the robot fell untouched on seeds {list(seeds)}")
    size = max(_PART * abs(natural), behavior.pid.step)
    return tuple(float(f"{natural + count * size:.4g}") for count in _SIZES)


def held_by(order: DriveOrder, attribute: str) -> Behavior:
    """The behavior that holds an attribute; of several, the first.

    Raises:
        MapError: there is none.
    """
    holding = [one for one in order.stimulation_map.behaviors.values() if one.pid is not None]
    for behavior in holding:
        if behavior.pid is not None and behavior.pid.attribute == attribute:
            return behavior
    known = ", ".join(one.pid.attribute for one in holding if one.pid is not None) or "none"
    raise MapError(
        f"{order.stimulation_map.source}: no behavior of mode pid holds '{attribute}'; held are: {known}"
    )
