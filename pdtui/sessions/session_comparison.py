"""How far two runs of the same drive are apart, attribute by attribute."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import SessionError
from pdtui.core.events import Event, describe_event
from pdtui.sessions.session_reader import Session


@dataclass(frozen=True)
class AttributeDeviation:
    """How far an attribute is off.

    Attributes:
        attribute: its name.
        unit: of the three numbers.
        first: in the first step that differs.
        largest: from there to the end.
        mean: from there to the end.
        step: at which it is largest.
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
    """How two sessions compare.

    Attributes:
        steps: control steps that both have.
        lengths: control steps of each.
        first_difference: the first step after which the digests differ; None if none does.
        deviations: of each attribute that differs from there on, those of the first step first.
        first_event: the first event that differs, in words; empty if none does.
        circumstances: what else differs: robot, seed, policy, map, versions.
    """

    steps: int
    lengths: tuple[int, int]
    first_difference: int | None
    deviations: tuple[AttributeDeviation, ...]
    first_event: str
    circumstances: tuple[str, ...]


def attribute_differences(a: Floats, b: Floats, attributes: Sequence[Attribute]) -> Floats:
    """Absolute differences; an angle that wraps differs by at most π, and NaN equals NaN.

    Args:
        a, b: shape (..., J).
        attributes: J of them.
    """
    with np.errstate(invalid="ignore"):
        change: Floats = np.abs(a - b)
    wraps = np.array([attribute.wraps for attribute in attributes], bool)
    change[..., wraps] = np.abs((change[..., wraps] + math.pi) % (2 * math.pi) - math.pi)
    change[(a == b) | (np.isnan(a) & np.isnan(b))] = 0.0
    return np.where(np.isnan(change), np.inf, change)


def summarise_deviations(
    change: Floats, attributes: Sequence[Attribute], first: int, spread: Floats
) -> tuple[AttributeDeviation, ...]:
    """Sum up what `attribute_differences` gave from step `first` on, worst first.

    Args:
        change: shape (n, J), n > 0; its first row is that of step `first`.
        attributes: J of them.
        first: number of the step.
        spread: by what to divide before attributes are ranked, shape (J,).
    """
    largest, worst = change.max(axis=0), change.argmax(axis=0)
    mean = change.mean(axis=0)
    order = np.lexsort((-largest / spread, -change[0] / spread))
    return tuple(
        AttributeDeviation(
            attributes[j].name,
            attributes[j].unit,
            float(change[0, j]),
            float(largest[j]),
            float(mean[j]),
            first + int(worst[j]),
        )
        for j in order
        if largest[j] > 0
    )


def attribute_spread(values: Floats) -> Floats:
    """Standard deviation of each attribute over a session, 1 for one that hardly moves; shape (J,)."""
    if not len(values):
        return np.ones(values.shape[1])
    with np.errstate(invalid="ignore"):
        spread: Floats = np.std(np.where(np.isfinite(values), values, 0.0), axis=0)
    return np.where(spread > 1e-9, spread, 1.0)


def compare_sessions(a: Session, b: Session) -> SessionComparison:
    """Find the first step that differs and how far the attributes are apart after it.

    Raises:
        SessionError: the two do not measure the same attributes.
    """
    if a.info.attributes != b.info.attributes:
        raise SessionError(f"{a.path} and {b.path}: of robots with other attributes; nothing can be compared")
    steps = min(a.steps, b.steps)
    differing: NDArray[np.intp] = np.flatnonzero(a.digests[:steps] != b.digests[:steps])
    first = int(differing[0]) if differing.size else None
    found: tuple[AttributeDeviation, ...] = ()
    if first is not None:
        change = attribute_differences(
            a.attributes[first:steps], b.attributes[first:steps], a.info.attributes
        )
        found = summarise_deviations(change, a.info.attributes, first, attribute_spread(a.attributes))
    return SessionComparison(
        steps, (a.steps, b.steps), first, found, _first_event(a.events, b.events, steps), _circumstances(a, b)
    )


def _first_event(a: tuple[Event, ...], b: tuple[Event, ...], steps: int) -> str:
    of_a, of_b = ([event for event in events if event.step < steps] for events in (a, b))
    for number in range(max(len(of_a), len(of_b))):
        one, other = (events[number] if number < len(events) else None for events in (of_a, of_b))
        if one != other:
            return f"event {number}: {_told(one)} in the first, {_told(other)} in the second"
    return ""


def _told(event: Event | None) -> str:
    return "none" if event is None else f"{describe_event(event)} before step {event.step}"


def _circumstances(a: Session, b: Session) -> tuple[str, ...]:
    lines = [
        f"{name}: {getattr(a.info, name)} and {getattr(b.info, name)}"
        for name in ("robot", "seed", "policy", "policy_hash", "stochastic", "start", "dt")
        if getattr(a.info, name) != getattr(b.info, name)
    ]
    if a.info.map_text != b.info.map_text:
        lines.append("map: not the same text")
    versions = dict.fromkeys((*a.versions, *b.versions))
    lines += [
        f"{name}: {a.versions.get(name, 'absent')} and {b.versions.get(name, 'absent')}"
        for name in versions
        if a.versions.get(name) != b.versions.get(name)
    ]
    return tuple(lines)
