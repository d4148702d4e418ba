"""The attributes of legged robots: which there are, and their values for one robot or for many at once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.robots.geometry import roll_pitch_yaw, rotate_vectors
from pdtui.robots.legged.legged_robot_state import LeggedRobotState, compute_yaws
from pdtui.robots.legged.observations_and_rewards import COMMAND_SCALES
from pdtui.robots.simulators.joint_and_trunk_attributes import torque_attributes

COMMAND_UNITS = {"forward": "m/s", "lateral": "m/s", "yaw rate": "rad/s", "heading": "rad"}
"""All commands that a legged robot can have, and their units. A robot has a yaw rate or a heading."""


def describe_attributes(
    commands: Iterable[str], joints: Sequence[str], limits: Sequence[float]
) -> tuple[Attribute, ...]:
    """Return the attributes of a legged robot: of its trunk, its commands, and the torques of its joints.

    Args:
        commands: Names of its commands.
        joints: Names of its joints.
        limits: Largest torque of each joint, N m.
    """
    return (
        Attribute("vx", "m/s"),
        Attribute("vy", "m/s"),
        Attribute("speed", "m/s"),
        Attribute("forward", "m/s", scale=float(COMMAND_SCALES[0])),
        Attribute("sideways", "m/s", scale=float(COMMAND_SCALES[1])),
        Attribute("yaw", "rad", wraps=True),
        Attribute("yaw rate", "rad/s", scale=float(COMMAND_SCALES[2])),
        Attribute("roll", "rad", wraps=True),
        Attribute("pitch", "rad"),
        Attribute("height", "m"),
        *(Attribute(f"{name} command", COMMAND_UNITS[name], wraps=name == "heading") for name in commands),
        *torque_attributes(joints, limits),
    )


def read_trunk_attributes(qpos: Floats, qvel: Floats, ground: float) -> tuple[float, ...]:
    """Return what `compute_trunk_attributes` does, of one robot, in a third of the time."""
    vx, vy = qvel[:2].tolist()
    roll, pitch, yaw = roll_pitch_yaw(*qpos[3:7].tolist())
    c, s = math.cos(yaw), math.sin(yaw)
    yaw_rate = float(rotate_vectors(qpos[3:7], qvel[3:6])[2])
    height = float(qpos[2]) - ground
    return (vx, vy, math.hypot(vx, vy), c * vx + s * vy, c * vy - s * vx, yaw, yaw_rate, roll, pitch, height)


def compute_trunk_attributes(motion: LeggedRobotState, ground: Floats) -> Floats:
    """Return the ten attributes that every legged robot begins with, shape (n, 10).

    In this order: velocity along x and y and its magnitude, velocity forward and to the left, yaw, yaw rate,
    roll, pitch, and height above the ground.

    Args:
        motion: The state of n robots.
        ground: Height of the ground under each trunk, m, shape (n,).
    """
    quaternion, velocity = motion.qpos[:, 3:7], motion.qvel[:, :3]
    w, x, y, z = quaternion.T
    vx, vy = velocity[:, 0], velocity[:, 1]
    yaw = compute_yaws(motion.qpos)
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack(
        [
            vx,
            vy,
            np.hypot(vx, vy),
            c * vx + s * vy,
            c * vy - s * vx,
            yaw,
            rotate_vectors(quaternion, motion.qvel[:, 3:6])[:, 2],
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0)),
            motion.qpos[:, 2] - ground,
        ]
    )
