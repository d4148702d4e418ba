"""Observations and rewards of a legged robot that follows commands, for any number of robots at once.

The observations, their scales and most rewards are those of legged_gym (Rudin et al., "Learning to Walk in
Minutes Using Massively Parallel Deep Reinforcement Learning", 2021).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.robots.legged.legged_robot_description import (
    FallRule,
    HeightScan,
    LeggedRewardWeights,
    LeggedRobotDescription,
)
from pdtui.robots.legged.legged_robot_state import LeggedRobotState

COMMAND_SCALES = np.array([2.0, 2.0, 0.25])
"""Factors on the observed commands: forward and lateral speed (m/s), yaw rate (rad/s)."""
LINEAR_SCALE, ANGULAR_SCALE, JOINT_SPEED_SCALE = 2.0, 0.25, 0.05
"""Factors on the observed velocities: of the trunk (m/s), about its axes (rad/s), of the joints (rad/s)."""
MAX_SCANNED = 1.0
"""Largest deviation of a scanned height that is observed, m."""
# Observations are clipped at ±100, as in legged_gym.
_MAX_OBSERVATION = 100.0
# Commanded speed below which a robot stands and earns nothing for steps.
_MIN_COMMAND = 0.1


def compute_legged_observations(motion: LeggedRobotState, description: LeggedRobotDescription) -> Floats:
    """Return what the policy observes, shape (n, `LeggedRobotDescription.observations`).

    In this order: height, velocity × 2, angular velocity × 0.25, direction of gravity, the commands (forward
    and lateral × 2, yaw rate × 0.25), joint angles relative to the default, joint velocities × 0.05, the last
    action and, if the ground is scanned, how far each point of it is below the trunk; see `HeightScan`.
    """
    parts = [
        motion.height[:, None],
        LINEAR_SCALE * motion.linear_velocity,
        ANGULAR_SCALE * motion.qvel[:, 3:6],
        -motion.up,
        (motion.command * COMMAND_SCALES)[:, : description.observed_commands],
        motion.qpos[:, 7:] - description.stance,
        JOINT_SPEED_SCALE * motion.qvel[:, 6:],
        motion.action,
    ]
    if description.scan is not None:
        parts.append(scale_heights(motion.qpos[:, 2:3] - motion.scanned, description.scan))
    clipped: Floats = np.clip(np.concatenate(parts, axis=1), -_MAX_OBSERVATION, _MAX_OBSERVATION)
    return clipped


def scale_heights(below: Floats, scan: HeightScan) -> Floats:
    """Return what is observed of how far scanned points are below the trunk, m, in any shape."""
    scaled: Floats = scan.scale * np.clip(below - scan.offset, -MAX_SCANNED, MAX_SCANNED)
    return scaled


def has_fallen(motion: LeggedRobotState, rule: FallRule) -> NDArray[np.bool_]:
    """Return whether each robot has fallen, shape (n,)."""
    low: NDArray[np.bool_] = motion.height < rule.least_height
    return low | (motion.up[:, 2] < rule.least_upright) | motion.trunk_touches


def compute_legged_rewards(
    motion: LeggedRobotState,
    foot_times: Floats,
    dt: float,
    description: LeggedRobotDescription,
    fell: NDArray[np.bool_],
) -> tuple[Floats, Floats]:
    """Return the rewards of a step, shape (n,), and the times of the feet, shape (n, 2, F).

    A foot's first time says how long it has been where it is, positive in the air and negative on the ground,
    and the second one how long its last swing took, s. Rewards are clipped below at 0, so that a policy that
    moves badly does not learn to end the episode; the penalty for a fall comes on top.
    """
    weights = description.rewards
    since, swings = foot_times[:, 0], foot_times[:, 1]
    air_time = np.maximum(since, 0.0)
    touching = motion.touching
    landed = touching & (air_time > 0.0)
    moving = (np.linalg.norm(motion.command, axis=1) > _MIN_COMMAND).astype(np.float64)
    error = motion.command[:, :2] - motion.linear_velocity[:, :2]
    yaw_error = motion.command[:, 2] - motion.qvel[:, 5]
    foot_speed = np.linalg.norm(motion.feet_velocity[:, :, :2], axis=2)
    too_low = np.minimum(0.0, motion.feet_height - weights.swing_height)
    posture = list(weights.posture_joints)
    off = motion.qpos[:, [7 + joint for joint in posture]] - description.stance[posture]
    times = np.where(touching, np.minimum(since, 0.0) - dt, air_time + dt)
    swings = np.where(landed, air_time, swings)
    reward = (
        weights.velocity * np.exp(-np.square(error).sum(1) / weights.tracking_width)
        + weights.yaw_rate * np.exp(-np.square(yaw_error) / weights.tracking_width)
        - weights.vertical_speed * np.square(motion.linear_velocity[:, 2])
        - weights.tilt_rate * np.square(motion.qvel[:, 3:5]).sum(1)
        - weights.tilt * np.square(motion.up[:, :2]).sum(1)
        - weights.torque * np.square(motion.torque).sum(1)
        - weights.joint_speed * np.square(motion.qvel[:, 6:]).sum(1)
        - weights.action_change * np.square(motion.action - motion.last_action).sum(1)
        - weights.height * np.square(np.minimum(0.0, motion.height - weights.target_height))
        - weights.swing * np.where(touching, 0.0, foot_speed * too_low**2).sum(1)
        - weights.slip * (touching * np.square(foot_speed)).sum(1)
        - weights.posture * np.square(off).sum(1)
    )
    steps = ((air_time - weights.least_air_time) * landed).sum(1) * moving * weights.steps
    gait = steps + _single_stance(times, swings, touching, weights) * moving
    new_times = np.stack([times, swings], axis=1)
    return np.maximum(0.0, reward * dt + gait * dt) - weights.fall * fell, new_times


def _single_stance(
    times: Floats, swings: Floats, touching: NDArray[np.bool_], weights: LeggedRewardWeights
) -> Floats:
    """Return the reward for standing on exactly one foot, per second, shape (n,)."""
    single = touching.sum(axis=1) == 1
    shared = np.abs(times).min(axis=1)
    # The foot on the ground has swung as long as the other one may now; a robot that limps earns less.
    equal = shared <= (swings * touching).sum(axis=1) + weights.longer_swing
    shared = np.minimum(shared, weights.longest_stance)
    rewards: Floats = single * equal * (weights.one_foot + weights.single_stance * shared)
    return rewards
