"""Plain data about robots: their shapes, their whole state and the commands that their policies follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pdtui.core.attributes import Floats

NO_OBSTACLES: Floats = np.empty((0, 3))


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
class RobotState:
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
