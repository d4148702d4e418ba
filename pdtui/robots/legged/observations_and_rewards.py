"""Observations and rewards of a legged robot that follows commands, for any number of robots at once.

The observations, their scales and most rewards are those of legged_gym (Rudin et al., "Learning to Walk in
Minutes Using Massively Parallel Deep Reinforcement Learning", 2021).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.robots.geometry import rotate_vectors

COMMAND_SCALES = np.array([2.0, 2.0, 0.25])
"""Factors on the observed commands: forward and lateral speed (m/s), yaw rate (rad/s)."""
LINEAR_SCALE, ANGULAR_SCALE, JOINT_SPEED_SCALE = 2.0, 0.25, 0.05
"""Factors on the observed velocities: of the trunk (m/s), about its axes (rad/s), of the joints (rad/s)."""
# Observations are clipped at ±100, as in legged_gym.
_MAX_OBSERVATION = 100.0
# Width of the reward for following a command, in squared m/s or rad/s.
_TRACKING_WIDTH = 0.25
# Commanded speed below which a robot stands and earns nothing for steps.
_MIN_COMMAND = 0.1
# Shortest time in the air that a step is rewarded for, s.
_MIN_AIR_TIME = 0.35
_FOOT_RADIUS = 0.03
# Gap between foot and ground that counts as contact, and height that a swinging foot should reach, m.
_CONTACT_GAP, _SWING_HEIGHT = 0.005, 0.1
# Below this height (m), or with less than this share of its vertical axis upright, the robot has fallen.
_MIN_HEIGHT, _MIN_UPRIGHT = 0.28, 0.5


@dataclass(frozen=True)
class LeggedRobotState:
    """The state of n robots, as observations and rewards need it.

    Attributes:
        qpos, qvel: Coordinates and velocities, free joint first, shapes (n, 19) and (n, 18).
        action, last_action: Actions of this step and of the one before, shape (n, 12).
        command: Commands, shape (n, 3).
        torque: Torques of the joints, N m, shape (n, 12).
        feet, feet_velocity: World positions (m) and velocities (m/s) of the feet, shape (n, 4, 3).
    """

    qpos: Floats
    qvel: Floats
    action: Floats
    last_action: Floats
    command: Floats
    torque: Floats
    feet: Floats
    feet_velocity: Floats

    @cached_property
    def linear(self) -> Floats:
        """The trunk's velocity in its own frame, m/s, shape (n, 3)."""
        return rotate_vectors(self.qpos[:, 3:7] * _CONJUGATE, self.qvel[:, :3])

    @cached_property
    def up(self) -> Floats:
        """The world's vertical in the trunk's frame, shape (n, 3)."""
        vertical = np.broadcast_to([0.0, 0.0, 1.0], (len(self.qpos), 3))
        return rotate_vectors(self.qpos[:, 3:7] * _CONJUGATE, vertical)


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def compute_legged_observations(motion: LeggedRobotState, default_angles: Floats, commands: int) -> Floats:
    """Return what the policy observes, shape (n, 46 + commands).

    In this order: height, velocity × 2, angular velocity × 0.25, direction of gravity, the first `commands`
    commands, joint angles relative to the default, joint velocities × 0.05, the last action.
    """
    parts = [
        motion.qpos[:, 2:3],
        LINEAR_SCALE * motion.linear,
        ANGULAR_SCALE * motion.qvel[:, 3:6],
        -motion.up,
        (motion.command * COMMAND_SCALES)[:, :commands],
        motion.qpos[:, 7:] - default_angles,
        JOINT_SPEED_SCALE * motion.qvel[:, 6:],
        motion.action,
    ]
    clipped: Floats = np.clip(np.concatenate(parts, axis=1), -_MAX_OBSERVATION, _MAX_OBSERVATION)
    return clipped


def has_fallen(motion: LeggedRobotState) -> NDArray[np.bool_]:
    """Return whether the trunk is on the ground or lies on its side, shape (n,)."""
    down: NDArray[np.bool_] = (motion.qpos[:, 2] < _MIN_HEIGHT) | (motion.up[:, 2] < _MIN_UPRIGHT)
    return down


def compute_legged_rewards(
    motion: LeggedRobotState, air_time: Floats, dt: float, target_height: float, default_angles: Floats
) -> tuple[Floats, Floats]:
    """Return the rewards of a step and how long each foot has now been in the air, shapes (n,) and (n, 4).

    The weights are rewards per second, as in legged_gym where it has the term. The last four terms are
    against crouching and shuffling: a height to keep, feet that swing and do not slip, hips near the default.
    Rewards are clipped below at 0, so that a policy that moves badly does not learn to end the episode.
    """
    touching = motion.feet[:, :, 2] - _FOOT_RADIUS < _CONTACT_GAP
    landed = touching & (air_time > 0.0)
    moving = (np.linalg.norm(motion.command, axis=1) > _MIN_COMMAND).astype(np.float64)
    error = motion.command[:, :2] - motion.linear[:, :2]
    yaw_error = motion.command[:, 2] - motion.qvel[:, 5]
    foot_speed = np.linalg.norm(motion.feet_velocity[:, :, :2], axis=2)
    too_low = np.minimum(0.0, motion.feet[:, :, 2] - _SWING_HEIGHT)
    reward = (
        1.5 * np.exp(-np.square(error).sum(1) / _TRACKING_WIDTH)
        + 0.8 * np.exp(-np.square(yaw_error) / _TRACKING_WIDTH)
        - 2.0 * np.square(motion.linear[:, 2])
        - 0.05 * np.square(motion.qvel[:, 3:5]).sum(1)
        - 3.0 * np.square(motion.up[:, :2]).sum(1)
        - 2e-5 * np.square(motion.torque).sum(1)
        - 2e-4 * np.square(motion.qvel[:, 6:]).sum(1)
        - 0.015 * np.square(motion.action - motion.last_action).sum(1)
        - 30.0 * np.square(np.minimum(0.0, motion.qpos[:, 2] - target_height))
        - 15.0 * np.where(touching, 0.0, foot_speed * too_low**2).sum(1)
        - 0.08 * (touching * np.square(foot_speed)).sum(1)
        - 0.15 * np.square(motion.qpos[:, 7::3] - default_angles[::3]).sum(1)
    )
    steps = ((air_time - _MIN_AIR_TIME) * landed).sum(1) * moving * 1.5
    return np.maximum(0.0, reward * dt + steps * dt), np.where(touching, 0.0, air_time + dt)
