"""Compare two sessions, or two runs of a drive, attribute by attribute."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, wrap_angles
from pdtui.core.drive_events import DriveEvent, describe_event
from pdtui.core.errors import SessionError
from pdtui.sessions.environment_versions import version_differences
from pdtui.sessions.session_reader import Session


@dataclass(frozen=True)
class ReplayDeviation:
    """How much an attribute deviates between two runs, in its unit.

    Attributes:
        first: deviation in the first step that differs.
        largest, mean: largest and mean deviation from that step to the end.
        step: the step with the largest deviation.
    """

    attribute: str
    unit: str
    first: float
    largest: float
    mean: float
    step: int

    def __str__(self) -> str:
        return (
            f"{self.attribute}: off by {self.first:.3g} {self.unit} there, "
            f"by up to {self.largest:.3g} after it (step {self.step})"
        )


@dataclass(frozen=True)
class SessionComparison:
    """The differences between two sessions.

    Attributes:
        steps: number of control steps that both have.
        lengths: number of control steps of each.
        first_difference: the first step after which the digests differ; None if they never do.
        deviations: the attributes that deviate from that step on, those that deviate first at the top.
        first_event: the first event that differs, in words; empty if all are equal.
        circumstances: other differences: robot, seed, policy, map, versions.
    """

    steps: int
    lengths: tuple[int, int]
    first_difference: int | None
    deviations: tuple[ReplayDeviation, ...]
    first_event: str
    circumstances: tuple[str, ...]


def absolute_attribute_differences(a: Floats, b: Floats, attributes: Sequence[Attribute]) -> Floats:
    """Return absolute differences of attributes; angles that wrap differ by at most π, and NaN equals NaN.

    The values `a` and `b` have the shape (..., J), for J attributes.
    """
    with np.errstate(invalid="ignore"):
        change: Floats = np.abs(a - b)
    wraps = np.array([attribute.wraps for attribute in attributes], bool)
    change[..., wraps] = np.abs(wrap_angles(change[..., wraps]))
    change[(a == b) | (np.isnan(a) & np.isnan(b))] = 0.0
    return np.where(np.isnan(change), np.inf, change)


def summarise_deviations(
    change: Floats, attributes: Sequence[Attribute], first: int, spread: Floats
) -> tuple[ReplayDeviation, ...]:
    """Summarise the `absolute_attribute_differences` from step `first` on, ordered from worst to best.

    Args:
        change: the differences, shape (n, J), n > 0; the first row belongs to step `first`.
        attributes: the J attributes.
        first: number of the first step that differs.
        spread: divisor of each attribute's deviations when they are ranked, shape (J,).
    """
    largest, worst = change.max(axis=0), change.argmax(axis=0)
    mean = change.mean(axis=0)
    order = np.lexsort((-largest / spread, -change[0] / spread))
    found = []
    for j in order[largest[order] > 0]:
        numbers = float(change[0, j]), float(largest[j]), float(mean[j]), first + int(worst[j])
        found.append(ReplayDeviation(attributes[j].name, attributes[j].unit, *numbers))
    return tuple(found)


def measure_attribute_spread(values: Floats) -> Floats:
    """Return the standard deviation of each attribute, shape (J,), over a session; 1 if nearly constant."""
    if not len(values):
        return np.ones(values.shape[1])
    with np.errstate(invalid="ignore"):
        spread: Floats = np.std(np.where(np.isfinite(values), values, 0.0), axis=0)
    return np.where(spread > 1e-9, spread, 1.0)


def compare_sessions(a: Session, b: Session) -> SessionComparison:
    """Find the first step that differs, and how much the attributes deviate from it on.

    Sessions with different attributes are a `SessionError`.
    """
    if a.info.attributes != b.info.attributes:
        why = "cannot be compared: their robots have different attributes"
        raise SessionError(f"{a.path} and {b.path}: {why}")
    steps = min(a.steps, b.steps)
    differing: NDArray[np.intp] = np.flatnonzero(a.digests[:steps] != b.digests[:steps])
    first = int(differing[0]) if differing.size else None
    found: tuple[ReplayDeviation, ...] = ()
    if first is not None:
        values_a, values_b = a.attributes[first:steps], b.attributes[first:steps]
        change = absolute_attribute_differences(values_a, values_b, a.info.attributes)
        found = summarise_deviations(change, a.info.attributes, first, measure_attribute_spread(a.attributes))
    return SessionComparison(
        steps,
        (a.steps, b.steps),
        first,
        found,
        _describe_first_event(a.events, b.events, steps),
        _list_circumstances(a, b),
    )


def _describe_first_event(a: Sequence[DriveEvent], b: Sequence[DriveEvent], steps: int) -> str:
    of_a, of_b = ([event for event in events if event.step < steps] for events in (a, b))
    for number, pair in enumerate(zip_longest(of_a, of_b)):
        if pair[0] != pair[1]:
            first, second = (
                "none" if event is None else f"{describe_event(event)} before step {event.step}"
                for event in pair
            )
            return f"event {number}: {first} in the first, {second} in the second"
    return ""


def _list_circumstances(a: Session, b: Session) -> tuple[str, ...]:
    lines = [
        f"{name}: {getattr(a.info, name)} and {getattr(b.info, name)}"
        for name in ("robot", "seed", "policy", "policy_hash", "stochastic", "start", "dt")
        if getattr(a.info, name) != getattr(b.info, name)
    ]
    if a.info.map_text != b.info.map_text:
        lines.append("map: not the same text")
    different = version_differences(a.versions, b.versions)
    lines += [f"{name}: {there} and {here}" for name, there, here in different]
    return tuple(lines)
