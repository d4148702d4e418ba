"""Kinematic attributes: the quantities of a robot that are measured at each control step, and angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import RobotError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Attribute:
    """A kinematic attribute: a measured quantity of the robot.

    Attributes:
        name: Short name, as maps and screens use it.
        unit: Physical unit of the values that `Robot.read_attributes` returns.
        scale, offset: Dissection compares spectra of ``value * scale + offset``, the attribute as the policy
            observes (or, for a torque, commands) it. The paper's discrepancy compares magnitudes, so both
            decide which unit matches: the scale at every frequency, the offset at the lowest.
        wraps: Whether the value is an angle that jumps at ±π.
    """

    name: str
    unit: str
    scale: float = 1.0
    wraps: bool = False
    offset: float = 0.0

    def as_observed(self, values: Floats) -> Floats:
        """Return values in the attribute's unit, in any shape, as the policy observes them."""
        scaled: Floats = values * self.scale
        # Adding 0 would turn −0 into 0.
        return scaled + self.offset if self.offset else scaled


def attribute_column(name: str, attributes: Sequence[Attribute], owner: str) -> int:
    """Return the column of an attribute; one that is missing is a `RobotError` that names the `owner`."""
    names = [attribute.name for attribute in attributes]
    if name not in names:
        raise RobotError(f"{owner}: no attribute '{name}'; available: {', '.join(names)}")
    return names.index(name)


def unwrap_angles(values: Floats, attributes: Sequence[Attribute]) -> Floats:
    """Return a copy of values by control step, shape (T, J), in which angles do not jump at ±π."""
    smooth = values.copy()
    for column, attribute in enumerate(attributes):
        if attribute.wraps:
            smooth[:, column] = np.unwrap(smooth[:, column])
    return smooth


AimDirection = Literal["increase", "decrease", "raise", "lower", "stop"]


@dataclass(frozen=True)
class BehaviorAim:
    """What a behavior is meant to do, which `pdtui evaluate` measures.

    Attributes:
        attribute: name of the attribute that it changes.
        direction: ``increase`` and ``decrease`` mean an attribute above and below 0 (a drift to +y, a turn to
            the left); ``raise`` and ``lower`` mean above and below its value without the behavior (a height,
            a joint's angle); ``stop`` means near 0.
    """

    attribute: str
    direction: AimDirection

    @property
    def sign(self) -> float:
        """1 where more of the attribute is wanted, −1 where less of it is."""
        return 1.0 if self.direction in ("increase", "raise") else -1.0


def wrap_angle(angle: float) -> float:
    """Return the same angle in (−π, π], rad."""
    wrapped = (angle + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.pi if wrapped == -np.pi else wrapped)


def wrap_angles(angles: Floats) -> Floats:
    """Return the same angles in [−π, π), rad, in any shape; NaN stays NaN."""
    wrapped: Floats = np.mod(angles + np.pi, 2.0 * np.pi) - np.pi
    return wrapped
