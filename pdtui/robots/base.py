"""What every robot offers, whichever simulator it lives in."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

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
    """

    robot: str
    state: Floats
    extras: tuple[Floats, ...]
    rng: Mapping[str, Any]


class Robot(gymnasium.Env[Floats, NDArray[np.float32]]):
    """A Gymnasium environment with named attributes, link poses and a snapshot.

    `step` puts ``cost`` (float) into its info and, when the episode ends, ``reason`` (str).
    """

    name: ClassVar[str]
    title: ClassVar[str]
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]

    @property
    @abstractmethod
    def control_dt(self) -> float:
        """Simulated time of one control step, s."""

    @abstractmethod
    def observe(self) -> Floats:
        """The observation of the present state, as `step` last returned it."""

    @abstractmethod
    def read_attributes(self) -> Floats:
        """Values of `attributes` in the present state, shape (J,)."""

    @abstractmethod
    def read_poses(self) -> Floats:
        """World pose of every body, shape (B, 7): x y z in m, then a quaternion w x y z."""

    @abstractmethod
    def snapshot(self) -> RobotSnapshot:
        """Copy the whole state."""

    @abstractmethod
    def restore(self, snapshot: RobotSnapshot) -> None:
        """Return to a snapshot, bit-exactly.

        Raises:
            RobotError: the snapshot is of another robot or has another size.
        """

    @abstractmethod
    def digest(self) -> int:
        """A 63-bit digest of the simulator's state: equal states have equal digests."""

    def attribute_index(self, name: str) -> int:
        """Column of an attribute in `read_attributes`.

        Raises:
            RobotError: the robot has no such attribute.
        """
        from pdtui.errors import RobotError

        for index, attribute in enumerate(self.attributes):
            if attribute.name == name:
                return index
        known = ", ".join(attribute.name for attribute in self.attributes)
        raise RobotError(f"{self.name}: no attribute '{name}'; there are {known}")
