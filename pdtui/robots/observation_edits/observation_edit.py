"""Edits of an observation: how it would read if one thing about the robot were different."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pdtui.core.attributes import Floats


@dataclass(frozen=True)
class ObservationEdit:
    """An edit that makes sense for one robot.

    Attributes:
        name: Name in maps.
        unit: Unit of its size.
        says: What it makes the observation say, as in "the torso is turned by so much".
        apply: Returns the edited observation, given the observation and the size; it copies.
        period: Size that makes no difference to the observation, 2π rad for an angle; 4π rad where the
            angle turns a quaternion, whose sign changes with every whole turn. 0 if there is none.
        dissected: Whether a dissection tries it; false for edits that help others and steer little alone,
            of which a robot may have many.
    """

    name: str
    unit: str
    says: str
    apply: Callable[[Floats, float], Floats]
    period: float = 0.0
    dissected: bool = True

    def wrap_size(self, size: float) -> float:
        """Return the size nearest to 0 that gives the same observation."""
        return math.remainder(size, self.period) if self.period else size


def set_observed_number(index: int, name: str, unit: str, says: str, scale: float = 1.0) -> ObservationEdit:
    """Return an edit that sets one number of the observation to size × scale."""

    def apply(observation: Floats, size: float) -> Floats:
        edited = observation.copy()
        edited[index] = size * scale
        return edited

    return ObservationEdit(name, unit, says, apply)


def offset_observed_number(
    index: int, name: str, unit: str, says: str, scale: float = 1.0
) -> ObservationEdit:
    """Return an edit that adds size × scale to one number of the observation."""

    def apply(observation: Floats, size: float) -> Floats:
        edited = observation.copy()
        edited[index] += size * scale
        return edited

    return ObservationEdit(name, unit, says, apply)


def scale_observed_number(index: int, name: str, says: str) -> ObservationEdit:
    """Return an edit that multiplies one number of the observation by 1 + size."""

    def apply(observation: Floats, size: float) -> Floats:
        edited = observation.copy()
        edited[index] *= 1.0 + size
        return edited

    return ObservationEdit(name, "", says, apply)
