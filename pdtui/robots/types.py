"""Plain data about robots; importing it loads no simulator, so that the screen may."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pdtui.errors import RobotError

Floats = NDArray[np.float64]
NO_OBSTACLES: Floats = np.empty((0, 3))


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


@dataclass(frozen=True)
class CommandRange:
    """What a policy was trained to be asked for by one command.

    Attributes:
        attribute: the one that is to become the command.
        low, high: in the attribute's unit.
    """

    attribute: str
    low: float
    high: float


@dataclass(frozen=True)
class Link:
    """One primitive shape of the robot, fixed to a body.

    Attributes:
        name: name for the viewer.
        body: row of `Robot.read_poses` that carries the shape.
        shape: a capsule's axis is its local z.
        size: (radius, half length) of a capsule, (radius,) of a sphere, half extents of a box; m.
        position: place in the body's frame, m.
        quaternion: orientation in the body's frame, w x y z.
    """

    name: str
    body: int
    shape: Literal["capsule", "sphere", "box"]
    size: tuple[float, ...]
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


@dataclass(frozen=True)
class RobotSnapshot:
    """The whole state of a robot: restoring it makes the future bit-identical.

    Attributes:
        robot: name of the robot that made it.
        state: the simulator's state vector.
        extras: what the robot's own Python side remembers.
        rng: state of the robot's random generator.
        memory: what the Python side of a wrapped environment remembers, plain data; None where there is none.
    """

    robot: str
    state: Floats
    extras: tuple[Floats, ...]
    rng: Mapping[str, Any]
    memory: Any = None


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


def unwrapped(values: Floats, attributes: Sequence[Attribute]) -> Floats:
    """A copy of values by control step, shape (T, J), in which angles do not jump at ±π."""
    smooth = values.copy()
    for column, attribute in enumerate(attributes):
        if attribute.wraps:
            smooth[:, column] = np.unwrap(smooth[:, column])
    return smooth
