"""Kinematic attributes: the quantities of a robot that are measured at each control step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import RobotError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Attribute:
    """A kinematic attribute: a measured quantity of the robot.

    Attributes:
        name: short name, as maps and screens use it.
        unit: physical unit of the values that `Robot.read_attributes` returns.
        scale: factor that dissection applies before it compares spectra. It brings the attribute to the
            scale at which the policy observes (or, for a torque, commands) it: the discrepancy of
            the paper compares magnitudes, so this factor decides which unit matches.
        wraps: whether the value is an angle that jumps at ±π.
    """

    name: str
    unit: str
    scale: float = 1.0
    wraps: bool = False


def column_of(name: str, attributes: Sequence[Attribute], owner: str) -> int:
    """Column of an attribute; `owner` is named where there is none.

    Raises:
        RobotError: there is no such attribute.
    """
    for column, attribute in enumerate(attributes):
        if attribute.name == name:
            return column
    known = ", ".join(attribute.name for attribute in attributes)
    raise RobotError(f"{owner}: no attribute '{name}'; there are {known}")


def unwrap_angles(values: Floats, attributes: Sequence[Attribute]) -> Floats:
    """A copy of values by control step, shape (T, J), in which angles do not jump at ±π."""
    smooth = values.copy()
    for column, attribute in enumerate(attributes):
        if attribute.wraps:
            smooth[:, column] = np.unwrap(smooth[:, column])
    return smooth
