"""Plain data about robots: shapes, feet, whole states, commands for the policy, controls for the operator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pdtui.core.attributes import Floats


@dataclass(frozen=True)
class CommandRange:
    """The range of one command on which a policy was trained.

    Attributes:
        attribute: name of the attribute that is to follow the command.
        low, high: ends of the range, in the attribute's unit.
    """

    attribute: str
    low: float
    high: float


@dataclass(frozen=True)
class ManualControl:
    """A component of the robot's action that an operator can take over from the policy.

    Attributes:
        name: name on the screen and in events, such as ``steering`` or ``throttle``.
        action: index of the component in the action.
        arrows: arrow keys that change it: ``sideways``, left towards 1 and right towards −1, so that a
            steering of 1 is full left; or ``lengthways``, up towards 1 and down towards −1, so that a
            negative throttle brakes.
        step: change by one key press; the value itself is always from −1 to 1.
        return_rate: how fast the value goes back to 0 by itself, 1/s; 0 for a control that stays where it is.
        scale: component of the action per value; negative where the simulator's sign is the other one.
    """

    name: str
    action: int
    arrows: Literal["sideways", "lengthways"]
    step: float = 0.1
    return_rate: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True)
class Link:
    """One primitive shape of the robot, fixed to a body.

    Attributes:
        name: name for the viewer.
        body: row of `Robot.read_poses` with the pose of the body.
        shape: kind of shape; the axis of a capsule is its local z axis.
        size: (radius, half length) of a capsule, (radius,) of a sphere, half extents of a box; m.
        position: position in the body's frame, m.
        quaternion: orientation in the body's frame, (w, x, y, z).
    """

    name: str
    body: int
    shape: Literal["capsule", "sphere", "box"]
    size: tuple[float, ...]
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


FootPlace = Literal["", "front left", "front right", "rear left", "rear right"]


@dataclass(frozen=True)
class Foot:
    """A part of the robot that it walks on.

    Attributes:
        name: name in tables.
        link: name of the link whose lowest point is the sole.
        place: which of four feet it is, so that a gait can be named; empty for robots with other feet.
        contact: name of the attribute that is above 0 while the foot touches the ground; empty if there is
            none. MuJoCo's contacts need none.
        contact_delay: control steps by which contacts are late. Box2D reports what touched before its last
            physics step, which matters where that is the whole control step.
    """

    name: str
    link: str
    place: FootPlace = ""
    contact: str = ""
    contact_delay: int = 0


@dataclass(frozen=True)
class RobotState:
    """The whole state of a robot: a robot that is restored to it continues bit for bit as before.

    Attributes:
        robot: name of the robot.
        state: state vector of the simulator.
        extras: state that the robot's own Python code keeps.
        rng: state of the robot's random generator.
        memory: state that the Python code of a wrapped environment keeps, as plain data; None if it has none.
    """

    robot: str
    state: Floats
    extras: tuple[Floats, ...]
    rng: Mapping[str, Any]
    memory: Any = None
