"""How far the attributes of two runs are apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Attribute, Floats, wrap_angles
from pdtui.sessions.streams.running_moments import RunningMoments

_KEPT_STEPS = 4096
"""Control steps after the first difference of which every deviation is kept; later ones are kept by block."""


@dataclass(frozen=True)
class AttributeDeviation:
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


def absolute_attribute_differences(a: Floats, b: Floats, attributes: Sequence[Attribute]) -> Floats:
    """Return absolute differences of attributes; angles that wrap differ by at most π, and NaN equals NaN.

    The values `a` and `b` have the shape (..., J), for J attributes.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        change: Floats = np.abs(a - b)
    wraps = np.array([attribute.wraps for attribute in attributes], bool)
    change[..., wraps] = np.abs(wrap_angles(change[..., wraps]))
    change[(a == b) | (np.isnan(a) & np.isnan(b))] = 0.0
    return np.where(np.isnan(change), np.inf, change)


class RunDeviationCounter:
    """Counts, block by block, how far the attributes of two runs are apart from the first difference on.

    Args:
        attributes: the J attributes.
    """

    def __init__(self, attributes: Sequence[Attribute]) -> None:
        self._attributes = attributes
        self._moments = [RunningMoments(len(attributes)) for _ in range(2)]
        self._kept: list[Floats] = []
        self._kept_ends: list[int] = []
        self._sum = np.zeros(len(attributes))
        self._largest, self._worst = np.zeros(len(attributes)), np.zeros(len(attributes), np.int64)
        self._rows = 0

    def add_spread(self, a: Floats, b: Floats) -> None:
        """Add the attributes of n control steps of both runs, shape (n, J), to their spreads."""
        if len(a):
            self._moments[0].add(a)
            self._moments[1].add(b)

    def add(self, steps: Sequence[int], a: Floats, b: Floats) -> None:
        """Add the attributes of n control steps of both runs, shape (n, J), from the first difference on."""
        if not len(steps):
            return
        change = absolute_attribute_differences(a, b, self._attributes)
        worst = change.argmax(axis=0)
        highest = change[worst, np.arange(change.shape[1])]
        larger = highest > self._largest
        self._worst[larger] = np.asarray(steps)[worst[larger]]
        self._largest = np.maximum(self._largest, highest)
        self._sum += change.sum(axis=0)
        exact = self._rows < _KEPT_STEPS
        self._kept += list(change) if exact else [highest]
        self._kept_ends += range(self._rows, self._rows + len(change)) if exact else [self._rows]
        self._rows += len(change)

    @property
    def spread(self) -> Floats:
        """The standard deviation of each attribute, shape (J,); 1 if nearly constant.

        That of the run in which it is smaller: a session that was tampered with must not widen what it is
        judged by.
        """
        deviation = np.fmin(*(moments.deviation for moments in self._moments))
        return np.where(deviation > 1e-9, deviation, 1.0)

    def count_within(self, tolerance: float) -> int:
        """Return the number of first steps in which every attribute is within the tolerance.

        The tolerance is in spreads. After some thousand steps, the number is exact only to a block.
        """
        limit = tolerance * self.spread
        for change, row in zip(self._kept, self._kept_ends, strict=True):
            if (change > limit).any():
                return row
        return self._rows

    def summarize(self) -> tuple[AttributeDeviation, ...]:
        """Return the attributes that deviate, ordered from worst to best by spreads in the first step."""
        if not self._rows:
            return ()
        first, mean, spread = self._kept[0], self._sum / self._rows, self.spread
        order = np.lexsort((-self._largest / spread, -first / spread))
        found = []
        for j in order[self._largest[order] > 0]:
            numbers = float(first[j]), float(self._largest[j]), float(mean[j]), int(self._worst[j])
            found.append(AttributeDeviation(self._attributes[j].name, self._attributes[j].unit, *numbers))
        return tuple(found)
