"""`pdtui evaluate --target yaw`: how precisely a PID on hidden units holds a target.

The paper's control-precision experiment (section 4), for any attribute that a map can hold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.errors import MapError
from pdtui.experiments.evaluate import STIMULATED_FROM, confidence_interval
from pdtui.robots.geometry import wrap_angle
from pdtui.sessions.events import Event
from pdtui.teleop.drive import build_loop
from pdtui.teleop.loop import ControlLoop
from pdtui.teleop.order import DriveOrder

TARGETS = (0.0, 0.4, 0.9, 1.2, 0.9, 0.4, 0.0, -0.4, -0.9, -1.2, -0.9, -0.4, 0.0)
STEPS_EACH = 100
SETTLED = 25


@dataclass(frozen=True)
class TargetError:
    """Errors at one target, over all seeds: mean of |error| over its steps, and over the last 25 of them."""

    target: float
    error: float
    settled: float


@dataclass(frozen=True)
class Tracking:
    """How well a target is held.

    Attributes:
        behavior: the behavior of mode ``pid``.
        attribute, unit: what it holds.
        seeds: of the drives.
        targets: in the order in which they were set.
        error, low, high: mean |error| over seeds with its 95 % interval.
        default_error: the same without the controller, on the same targets.
        falls: seeds on which the robot fell.
    """

    behavior: str
    attribute: str
    unit: str
    seeds: tuple[int, ...]
    targets: tuple[TargetError, ...]
    error: float
    low: float
    high: float
    default_error: float
    falls: int


def evaluate_tracking(
    order: DriveOrder,
    attribute: str,
    seeds: Sequence[int],
    *,
    targets: Sequence[float] = TARGETS,
    progress: Callable[[int, int], None] | None = None,
) -> Tracking:
    """Set the targets one after the other, 100 control steps each, on every seed.

    As with fixed behaviors, the policy walks for `STIMULATED_FROM` steps before it is touched.

    Raises:
        MapError: the map has no behavior of mode ``pid`` for the attribute.
        PdtuiError: robot or policy cannot be had.
    """
    name = held_by(order, attribute)
    built = build_loop(order)
    column = built.robot.attribute_index(attribute)
    errors: list[np.ndarray] = []
    untouched: list[np.ndarray] = []
    falls = 0
    for done, seed in enumerate(seeds, start=1):
        followed, fell = _follow(built, name, column, seed, targets)
        errors.append(followed)
        falls += fell
        untouched.append(_follow(built, "", column, seed, targets)[0])
        if progress is not None:
            progress(done, len(seeds))
    table = np.array(errors)
    means = np.nanmean(table, axis=(1, 2))
    low, high = confidence_interval(means)
    return Tracking(
        name,
        attribute,
        built.robot.attributes[column].unit,
        tuple(seeds),
        tuple(
            TargetError(target, float(np.nanmean(table[:, row])), float(np.nanmean(table[:, row, -SETTLED:])))
            for row, target in enumerate(targets)
        ),
        float(means.mean()),
        low,
        high,
        float(np.nanmean(np.array(untouched))),
        falls,
    )


def held_by(order: DriveOrder, attribute: str) -> str:
    """Name of the behavior that holds an attribute.

    Raises:
        MapError: there is none.
    """
    held = {
        behavior.pid.attribute: behavior.name
        for behavior in order.stimulation_map.behaviors.values()
        if behavior.pid is not None
    }
    if attribute not in held:
        known = ", ".join(held) or "none"
        raise MapError(
            f"{order.stimulation_map.source}: no behavior of mode pid holds '{attribute}'; held are: {known}"
        )
    return held[attribute]


def _follow(
    built: ControlLoop, name: str, column: int, seed: int, targets: Sequence[float]
) -> tuple[np.ndarray, bool]:
    """|error| by target and step, NaN after a fall; an empty name leaves the policy alone."""
    loop = ControlLoop(built.robot, built.policy, built.map, seed)
    wraps = built.robot.attributes[column].wraps
    for _ in range(STIMULATED_FROM):
        if loop.advance().ended:
            return np.full((len(targets), STEPS_EACH), np.nan), True
    errors = np.full((len(targets), STEPS_EACH), np.nan)
    for row, target in enumerate(targets):
        for column_step in range(STEPS_EACH):
            events = []
            if name and column_step == 0:
                events = [Event(loop.step, "behavior", name)] if row == 0 else []
                events.append(Event(loop.step, "target", name, target))
            record = loop.advance(events)
            error = target - float(record.attributes[column])
            errors[row, column_step] = abs(wrap_angle(error) if wraps else error)
            if record.ended:
                return errors, True
    return errors, False
