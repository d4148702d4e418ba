"""The state of legged robots, for any number of them at once, and how it is read from MuJoCo's numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, wrap_angles
from pdtui.core.errors import RobotError
from pdtui.robots.geometry import rotate_vectors
from pdtui.robots.legged.legged_robot_description import LeggedRobotDescription

# Gap between foot and ground that counts as contact, m.
_CONTACT_GAP = 0.005
# Largest yaw rate by which a heading is followed, rad/s.
_MAX_YAW_RATE = 1.0
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
GroundHeights = Callable[[Floats], Floats]
"""Returns the heights of the ground, shape (n, K), at points x y of each of n robots, shape (n, K, 2)."""


@dataclass(frozen=True)
class LeggedRobotState:
    """The state of n robots with J joints and F feet, as observations and rewards need it.

    Attributes:
        qpos, qvel: Coordinates and velocities, free joint first, shapes (n, 7 + J) and (n, 6 + J).
        action, last_action: Actions of this step and of the one before, shape (n, J).
        command: Commanded velocity forward and to the left (m/s) and yaw rate (rad/s), shape (n, 3).
        torque: Torques of the joints, N m, shape (n, J).
        feet_velocity: World velocities of the feet, m/s, shape (n, F, 3).
        feet_height: Heights of the feet above the ground, m, shape (n, F).
        touching: Which feet are on the ground, shape (n, F).
        trunk_touches: Whether the trunk touches something, shape (n,); false without a sensor for it.
        scanned: Heights of the ground at the points of the scan, m, shape (n, P).
        height: Height of the trunk above the ground, m, shape (n,).
    """

    qpos: Floats
    qvel: Floats
    action: Floats
    last_action: Floats
    command: Floats
    torque: Floats
    feet_velocity: Floats
    feet_height: Floats
    touching: NDArray[np.bool_]
    trunk_touches: NDArray[np.bool_]
    scanned: Floats
    height: Floats

    @cached_property
    def linear_velocity(self) -> Floats:
        """The trunk's velocity in its own frame, m/s, shape (n, 3)."""
        return rotate_vectors(self.qpos[:, 3:7] * _CONJUGATE, self.qvel[:, :3])

    @cached_property
    def up(self) -> Floats:
        """The world's vertical in the trunk's frame, shape (n, 3)."""
        vertical = np.broadcast_to([0.0, 0.0, 1.0], (len(self.qpos), 3))
        return rotate_vectors(self.qpos[:, 3:7] * _CONJUGATE, vertical)


class LeggedStateReader:
    """Reads states from the numbers of a model's sensors.

    Raises:
        RobotError: The model lacks a sensor that the description names.
    """

    def __init__(self, model: mujoco.MjModel, description: LeggedRobotDescription) -> None:
        self._description = description
        self._names = {model.sensor(index).name: index for index in range(model.nsensor)}
        self._model = model
        feet = description.feet
        self._feet = np.concatenate([self._columns(name, 3) for name in feet])
        self._velocity = np.concatenate([self._columns(f"{name}_velocity", 3) for name in feet])
        touch = [f"{name}_touch" for name in feet]
        senses = all(name in self._names for name in touch)
        self._touch = np.concatenate([self._columns(name, 1) for name in touch]) if senses else None
        trunk = description.fall.touch_sensor
        self._trunk = self._columns(trunk, 1) if trunk else None

    def read(
        self,
        qpos: Floats,
        qvel: Floats,
        actions: tuple[Floats, Floats],
        command: Floats,
        torque: Floats,
        sensors: Floats,
        ground: GroundHeights | None = None,
    ) -> LeggedRobotState:
        """Return the state of n robots.

        Args:
            qpos, qvel, torque: As in `LeggedRobotState`.
            actions: Actions of this step and of the one before.
            command: What is commanded; the third number is a heading, rad, if the robot follows one.
            sensors: What the sensors of the model read, shape (n, sensors).
            ground: The ground; without one, it is level.
        """
        count, one = len(qpos), self._description
        feet = sensors[:, self._feet].reshape(count, -1, 3)
        if one.heading_gain:
            command = _follow_heading(command, qpos, one.heading_gain)
        scanned = np.zeros((count, 0 if one.scan is None else len(one.scan.points)))
        feet_height, height = feet[:, :, 2], qpos[:, 2]
        if ground is not None:
            feet_height = feet_height - ground(feet[:, :, :2])
            points = qpos[:, None, :2] if one.scan is None else _turned_points(qpos, one.scan.points)
            under = ground(points)
            scanned = scanned if one.scan is None else under
            height = height - under.mean(axis=1)
        if self._touch is None:
            touching = feet_height - one.foot_radius < _CONTACT_GAP
        else:
            touching = sensors[:, self._touch] > 0.0
        trunk = np.zeros(count, bool) if self._trunk is None else sensors[:, self._trunk[0]] > 0.0
        velocity = sensors[:, self._velocity].reshape(count, -1, 3)
        motion = (qpos, qvel, *actions, command, torque, velocity, feet_height)
        return LeggedRobotState(*motion, touching, trunk, scanned, height)

    def _columns(self, name: str, count: int) -> NDArray[np.intp]:
        if name not in self._names:
            known = ", ".join(self._names) or "none"
            raise RobotError(f"{self._description.model.name}: no sensor '{name}'; available: {known}")
        first = int(self._model.sensor_adr[self._names[name]])
        return np.arange(first, first + count)


def compute_yaws(qpos: Floats) -> Floats:
    """Return the yaw of each robot's trunk, rad, shape (n,)."""
    w, x, y, z = qpos[:, 3:7].T
    yaws: Floats = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return yaws


def _follow_heading(command: Floats, qpos: Floats, gain: float) -> Floats:
    """Return the commands with the yaw rate that leads to the heading in its place."""
    error = wrap_angles(command[:, 2] - compute_yaws(qpos))
    rate = np.clip(gain * error, -_MAX_YAW_RATE, _MAX_YAW_RATE)
    return np.column_stack([command[:, :2], rate])


def _turned_points(qpos: Floats, points: Floats) -> Floats:
    """Return points around each trunk, turned by its yaw, in the world, shape (n, P, 2)."""
    yaws = compute_yaws(qpos)[:, None]
    c, s = np.cos(yaws), np.sin(yaws)
    x, y = points.T
    turned = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    world: Floats = qpos[:, None, :2] + turned
    return world
