"""Cassie in MuJoCo: a biped that walks forward where it is told to head, on a plane or on rough ground."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.robot_links_and_state import CommandRange, Foot
from pdtui.robots.legged.legged_robot import LeggedRobot
from pdtui.robots.legged.legged_robot_description import (
    FallRule,
    HeightScan,
    LeggedRewardWeights,
    LeggedRobotDescription,
)
from pdtui.robots.legged.legged_robot_state import LeggedRobotState
from pdtui.robots.robot import TrainingRecipe

SIDES = ("left", "right")
_JOINTS = ("hip abduction", "hip rotation", "hip flexion", "knee", "ankle", "toe")
_LEG = (0.0, 1.0, -1.8, 1.57, -1.57)
CASSIE_DESCRIPTION = LeggedRobotDescription(
    model=Path(__file__).parent / "models" / "cassie.xml",
    feet=SIDES,
    default_angles=(0.1, *_LEG, -0.1, *_LEG),
    start_height=1.0,
    fall=FallRule(touch_sensor="pelvis_touch"),
    # It may jump and flip where a person makes it; nothing here rewards that. Standing on one foot at a time
    # is what makes it step; see the biped's reward in Mittal et al., "Orbit" (2023).
    rewards=LeggedRewardWeights(
        velocity=2.0,
        yaw_rate=1.0,
        tracking_width=0.4,
        vertical_speed=1.0,
        tilt_rate=0.05,
        tilt=3.0,
        torque=5e-6,
        joint_speed=2e-4,
        action_change=0.01,
        height=10.0,
        target_height=0.8,
        swing=5.0,
        swing_height=0.12,
        slip=0.25,
        posture=0.4,
        posture_joints=(0, 1, 6, 7),
        steps=0.0,
        one_foot=1.0,
        single_stance=2.5,
        fall=2.0,
    ),
    max_action=3.0,
    heading_gain=0.5,
    scan=HeightScan(),
)


class Cassie(LeggedRobot):
    """Cassie without its springs, on a plane or on rough ground; a control step is 0.02 s.

    The observation has 170 numbers: the 49 of `compute_legged_observations` with three commands, and how far
    121 points of the ground are below the pelvis. The lateral command is always 0, and the yaw rate is the
    one that leads to the commanded heading. The 12 actions move the targets of the joints' PD controllers by
    0.5 rad each around the default. The reward is that of following the commands; see
    `compute_legged_rewards`. An episode ends when the pelvis touches the ground.

    Args:
        terrain: Where it starts unless `reset` says otherwise: on a ``plane`` or on ``rough`` ground.
        roughness: Largest height of rough ground, m.
        random_commands: Whether every reset draws the commands, for training's scores, instead of commanding
            1 m/s forward, along x.
    """

    name = "cassie"
    title = "Cassie (MuJoCo)"
    description = CASSIE_DESCRIPTION
    feet = tuple(Foot(f"{side} foot", f"{side}_toe_capsule") for side in SIDES)
    starts = ("plane", "rough")
    training_recipe = TrainingRecipe(
        options={"random_commands": True, "terrain": "rough", "roughness": 0.06},
        settings={
            "worlds": 256,
            "minibatch": 2048,
            "layers": (512, 256, 128),
            "activation": "elu",
            "total_steps": 20_000_000,
            "reward_scale": 2.0,
            "entropy": 0.004,
            "log_std": -1.1,
            "evaluate_every": 1_000_000,
            "evaluate_episodes": 16,
            "evaluate_robots": 16,
            "evaluate_steps": 500,
        },
        robot_batch="pdtui.training.legged_robot_batch:LeggedRobotBatch",
    )
    commands: Mapping[str, float] = MappingProxyType({"forward": 1.0, "heading": 0.0})
    command_ranges = MappingProxyType(
        {"forward": CommandRange("forward", 0.0, 1.6), "heading": CommandRange("yaw", -1.5, 1.5)}
    )

    def __init__(
        self,
        terrain: Literal["plane", "rough"] = "plane",
        roughness: float = 0.05,
        random_commands: bool = False,
    ) -> None:
        super().__init__(random_commands, terrain, roughness)
        self.attributes = (
            *self.attributes,
            Attribute("pelvis pitch", "rad", wraps=True),
            *(Attribute(f"{side} foot height", "m") for side in SIDES),
            *(Attribute(f"{side} contact", "") for side in SIDES),
        )

    def joint_names(self) -> tuple[str, ...]:
        return tuple(f"{side} {joint}" for side in SIDES for joint in _JOINTS)

    def read_attributes(self) -> Floats:
        return np.concatenate([super().read_attributes(), self._own_attributes(self.read_state())[0]])

    def compute_attributes(self, motion: LeggedRobotState, commands: Floats) -> Floats:
        shared = super().compute_attributes(motion, commands)
        return np.concatenate([shared, self._own_attributes(motion)], axis=1)

    def _own_attributes(self, motion: LeggedRobotState) -> Floats:
        # Unlike the Euler angle, this pitch goes on beyond a right angle, so that it shows a flip.
        pitch = np.arctan2(-motion.up[:, 0], motion.up[:, 2])
        return np.concatenate([pitch[:, None], motion.feet_height, motion.touching], axis=1)
