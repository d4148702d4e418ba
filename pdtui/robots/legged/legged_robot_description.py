"""The description of a legged robot, from which its world and its training come."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from pdtui.core.attributes import Floats


@dataclass(frozen=True)
class FallRule:
    """When a robot has fallen: as soon as one of these holds.

    Attributes:
        least_height: The trunk is less than this above the ground, m.
        least_upright: Less than this share of the trunk's vertical axis points up: 0.5 is a lean of 60°.
        touch_sensor: This touch sensor of the model, on the trunk, feels something; empty for none.
    """

    least_height: float = 0.0
    least_upright: float = -1.0
    touch_sensor: str = ""


@dataclass(frozen=True)
class LeggedRewardWeights:
    """Weights of the rewards and penalties, per second unless they say otherwise.

    Those of velocity and yaw rate are rewards for following the commands. Most of the others are penalties,
    of which legged_gym has many (Rudin et al., 2021).

    Attributes:
        velocity, yaw_rate: Rewards for following the commanded velocity and yaw rate: the weight ×
            exp(−deviation² / `tracking_width`).
        tracking_width: Squared m/s or rad/s.
        vertical_speed, tilt_rate: Per squared m/s up and down, and per squared rad/s of roll and pitch.
        tilt: Per squared horizontal part of the trunk's vertical axis.
        torque, joint_speed: Per squared N m and squared rad/s, summed over the joints.
        action_change: Per squared change of the action.
        height: Per squared m by which the trunk is below `target_height`.
        target_height: Height of the trunk above the ground, m.
        swing: Per m/s of a foot in the air and squared m by which it is below `swing_height`.
        swing_height: Height that a swinging foot should reach, m.
        slip: Per squared m/s of a foot on the ground.
        posture: Per squared rad by which `posture_joints` are off the default.
        posture_joints: Indices of these joints.
        steps: Reward per landing of a foot and s by which it was in the air for longer than `least_air_time`,
            while the robot is commanded to move.
        least_air_time: Shortest time in the air that is rewarded, s.
        one_foot: Reward while the robot is commanded to move and exactly one foot is on the ground.
        single_stance: Further reward then, per s for which both feet have been where they are, up to
            `longest_stance`.
        longest_stance: Longest such time that is rewarded, s.
        longer_swing: By how much longer than the other foot's last swing a foot may be in the air until both
            rewards end, s; infinite for a robot that may limp.
        fall: Penalty for a fall, once.
    """

    velocity: float = 1.5
    yaw_rate: float = 0.8
    tracking_width: float = 0.25
    vertical_speed: float = 2.0
    tilt_rate: float = 0.05
    tilt: float = 3.0
    torque: float = 2e-5
    joint_speed: float = 2e-4
    action_change: float = 0.015
    height: float = 30.0
    target_height: float = 0.5
    swing: float = 15.0
    swing_height: float = 0.1
    slip: float = 0.08
    posture: float = 0.15
    posture_joints: tuple[int, ...] = ()
    steps: float = 1.5
    least_air_time: float = 0.35
    one_foot: float = 0.0
    single_stance: float = 0.0
    longest_stance: float = 0.4
    longer_swing: float = math.inf
    fall: float = 0.0


@dataclass(frozen=True)
class HeightScan:
    """Points around the trunk at which a robot observes the height of the ground.

    They form a square that turns with the trunk's yaw, in rows from back to front and each from right to
    left. Observed is how far a point is below the trunk, less `offset`, at most ±1 m, × `scale`.

    Attributes:
        reach: Half the length of a side, m.
        count: Points per side.
        offset: m.
        scale: Factor, per m.
    """

    reach: float = 0.5
    count: int = 11
    offset: float = 0.5
    scale: float = 5.0

    @cached_property
    def points(self) -> Floats:
        """The points from the trunk, x ahead and y to the left, m, shape (count², 2)."""
        side = np.linspace(-self.reach, self.reach, self.count)
        x, y = np.meshgrid(side, side, indexing="ij")
        return np.stack([x.ravel(), y.ravel()], axis=-1)


@dataclass(frozen=True)
class LeggedRobotDescription:
    """Everything that `LeggedRobot` and its training need to know about a robot.

    The model's first joint is the trunk's free joint, and every other joint is a hinge with a ``position``
    actuator, in the same order; the gains and limits of the joints are the actuators'. For each foot, the
    model has a ``framepos`` sensor with the foot's name, a ``framelinvel`` sensor ``NAME_velocity`` and, if
    its ground is not flat, a ``touch`` sensor ``NAME_touch``. The geom of the ground is called ``floor``.

    Attributes:
        model: The MJCF file.
        feet: Names of the feet.
        default_angles: Angles of the joints at action 0, rad.
        start_height: Height of the trunk at the start, m.
        fall: When it has fallen.
        rewards: What training rewards.
        action_scale: Change of a joint's target angle per unit of action, rad.
        max_action: Bound of the actions' magnitude.
        substeps: Physics steps per control step.
        foot_radius: Height of a foot's sensor above the ground on which it stands, m, where there is no touch
            sensor.
        observed_commands: How many commands the policy observes: forward and lateral velocity, yaw rate.
        heading_gain: Commanded yaw rate per rad of deviation from the commanded heading, per s, up to 1
            rad/s; 0 for a robot whose yaw rate is commanded itself.
        scan: Points at which it observes the height of the ground, if it does.
    """

    model: Path
    feet: tuple[str, ...]
    default_angles: tuple[float, ...]
    start_height: float
    fall: FallRule
    rewards: LeggedRewardWeights
    action_scale: float = 0.5
    max_action: float = 2.0
    substeps: int = 4
    foot_radius: float = 0.03
    observed_commands: int = 3
    heading_gain: float = 0.0
    scan: HeightScan | None = None

    @cached_property
    def stance(self) -> Floats:
        """The default angles, shape (joints,)."""
        return np.array(self.default_angles)

    @property
    def observations(self) -> int:
        """How many numbers a policy observes."""
        scanned = self.scan.count**2 if self.scan is not None else 0
        return 10 + self.observed_commands + 3 * len(self.default_angles) + scanned
