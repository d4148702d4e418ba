"""What a legged robot that follows commands observes and is paid, for many worlds at once.

Observations and their scales are legged_gym's (Rudin et al., "Learning to Walk in Minutes Using Massively
Parallel Deep Reinforcement Learning", 2021); so are the kinds of rewards.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.robots.geometry import rotate

_CLIP = 100.0
_SIGMA = 0.25
_STRIDE = 0.35
_FOOT_RADIUS = 0.03
_TOUCHES = 0.005
COMMAND_SCALES = np.array([2.0, 2.0, 0.25])
"""Of the commands: forward and lateral speed (m/s), yaw rate (rad/s)."""


@dataclass(frozen=True)
class LeggedMotion:
    """The state of n worlds, as observations and rewards need it.

    Attributes:
        qpos, qvel: shapes (n, 19) and (n, 18), free joint first.
        action, last_action: commanded in this step and the one before, shape (n, 12).
        command: shape (n, 3).
        torque: of the joints, shape (n, 12).
        feet: world positions, shape (n, 4, 3),
        feet_velocity: and velocities, the same.
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
        """Velocity in the body's frame, m/s."""
        return rotate(_inverse(self.qpos[:, 3:7]), self.qvel[:, :3])

    @cached_property
    def up(self) -> Floats:
        """The world's vertical in the body's frame."""
        return rotate(_inverse(self.qpos[:, 3:7]), np.broadcast_to([0.0, 0.0, 1.0], (len(self.qpos), 3)))


def _inverse(quaternion: Floats) -> Floats:
    inverse: Floats = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def legged_observations(motion: LeggedMotion, default: Floats, commands: int) -> Floats:
    """What the policy sees, shape (n, 46 + commands).

    Height, velocity × 2, angular velocity × 0.25, gravity's direction, the first `commands` commands, joint
    positions less the default, joint velocities × 0.05, the last action.
    """
    seen: Floats = np.concatenate(
        [
            motion.qpos[:, 2:3],
            2.0 * motion.linear,
            0.25 * motion.qvel[:, 3:6],
            -motion.up,
            (motion.command * COMMAND_SCALES)[:, :commands],
            motion.qpos[:, 7:] - default,
            0.05 * motion.qvel[:, 6:],
            motion.action,
        ],
        axis=1,
    )
    clipped: Floats = np.clip(seen, -_CLIP, _CLIP)
    return clipped


def fallen(motion: LeggedMotion) -> NDArray[np.bool_]:
    """Whether the trunk is on the ground or lies on its side, shape (n,)."""
    down: NDArray[np.bool_] = (motion.qpos[:, 2] < _LOWEST) | (motion.up[:, 2] < _UPRIGHT)
    return down


_LOWEST, _UPRIGHT = 0.28, 0.5


@dataclass(frozen=True)
class RewardWeights:
    """Weights of what is paid each second, as in legged_gym where it has them.

    The last ones work against crouching and shuffling: a height to keep, feet that swing and do not slip.
    """

    forward: float = 1.5
    yaw: float = 0.8
    vertical: float = -2.0
    rolling: float = -0.05
    tilt: float = -3.0
    torque: float = -2e-5
    joint_speed: float = -2e-4
    action_rate: float = -0.015
    air_time: float = 1.5
    height: float = -30.0
    clearance: float = -15.0
    slip: float = -0.08
    stance: float = -0.15


def legged_rewards(
    motion: LeggedMotion,
    air_time: Floats,
    dt: float,
    target_height: float,
    default: Floats,
    weights: RewardWeights,
) -> tuple[Floats, Floats]:
    """What a step pays, and how long each foot has been in the air since, shapes (n,) and (n, 4).

    The sum is clipped at 0 from below: a policy that moves badly must not learn that ending it is better.
    """
    touching = motion.feet[:, :, 2] - _FOOT_RADIUS < _TOUCHES
    landed = touching & (air_time > 0.0)
    moving = (np.linalg.norm(motion.command, axis=1) > 0.1).astype(np.float64)
    wrong = motion.command[:, :2] - motion.linear[:, :2]
    turning = motion.command[:, 2] - motion.qvel[:, 5]
    planar = np.linalg.norm(motion.feet_velocity[:, :, :2], axis=2)
    swing = np.where(touching, 0.0, planar * np.minimum(0.0, motion.feet[:, :, 2] - 0.1) ** 2)
    paid = (
        weights.forward * np.exp(-np.square(wrong).sum(1) / _SIGMA)
        + weights.yaw * np.exp(-np.square(turning) / _SIGMA)
        + weights.vertical * np.square(motion.linear[:, 2])
        + weights.rolling * np.square(motion.qvel[:, 3:5]).sum(1)
        + weights.tilt * np.square(motion.up[:, :2]).sum(1)
        + weights.torque * np.square(motion.torque).sum(1)
        + weights.joint_speed * np.square(motion.qvel[:, 6:]).sum(1)
        + weights.action_rate * np.square(motion.action - motion.last_action).sum(1)
        + weights.height * np.square(np.minimum(0.0, motion.qpos[:, 2] - target_height))
        + weights.clearance * swing.sum(1)
        + weights.slip * (touching * np.square(planar)).sum(1)
        + weights.stance * np.square(motion.qpos[:, 7::3] - default[::3]).sum(1)
    )
    stepped = ((air_time - _STRIDE) * landed).sum(1) * moving * weights.air_time
    total = np.maximum(0.0, paid * dt + stepped * dt)
    return total, np.where(touching, 0.0, air_time + dt)
