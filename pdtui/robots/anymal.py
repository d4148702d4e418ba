"""ANYmal-C in MuJoCo: a quadruped whose policy follows commands, and a variant with one command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from pdtui.core.robot_links_and_state import CommandRange, Foot
from pdtui.robots.legged.legged_robot import LeggedRobot
from pdtui.robots.legged.legged_robot_description import FallRule, LeggedRewardWeights, LeggedRobotDescription
from pdtui.robots.training_recipe import TrainingRecipe

LEGS = ("LF", "LH", "RF", "RH")
ANYMAL_DESCRIPTION = LeggedRobotDescription(
    model=Path(__file__).parent / "models" / "anymal_c.xml",
    feet=LEGS,
    # Hip, thigh and knee of each of the legs.
    default_angles=(0.0, 0.4, -0.8, 0.0, -0.4, 0.8) * 2,
    start_height=0.55,
    fall=FallRule(least_height=0.28, least_upright=0.5),
    rewards=LeggedRewardWeights(target_height=0.52, posture_joints=(0, 3, 6, 9)),
)


class Anymal(LeggedRobot):
    """ANYmal-C on a plane; a control step is 0.02 s.

    The observation has 49 numbers, or 47 with the forward command alone; see
    `compute_legged_observations`. The 12 actions move the targets of the joints' PD controllers by 0.5 rad
    each around the default. The reward is that of following the commands; see `compute_legged_rewards`. An
    episode ends when the trunk is on the ground or on its side.

    Attributes:
        commands: Those that the policy observes, m/s and rad/s.

    Args:
        random_commands: Whether every reset draws the commands, for training's scores, instead of commanding
            1 m/s forward.
    """

    name = "anymal"
    title = "ANYmal-C (MuJoCo)"
    feet = (
        Foot("LF", "LF_FOOT", "front left"),
        Foot("RF", "RF_FOOT", "front right"),
        Foot("LH", "LH_FOOT", "rear left"),
        Foot("RH", "RH_FOOT", "rear right"),
    )
    description = ANYMAL_DESCRIPTION
    training_recipe = TrainingRecipe(
        options={"random_commands": True},
        settings={
            "worlds": 256,
            "minibatch": 2048,
            "layers": (128, 64, 32),
            "reward_scale": 2.0,
            "entropy": 0.004,
            "evaluate_every": 1_000_000,
            "evaluate_steps": 500,
        },
        robot_batch="pdtui.training.legged_robot_batch:LeggedRobotBatch",
    )
    commands: Mapping[str, float] = MappingProxyType({"forward": 1.0, "lateral": 0.0, "yaw rate": 0.0})
    command_ranges = MappingProxyType(
        {
            "forward": CommandRange("forward", -0.3, 1.4),
            "lateral": CommandRange("sideways", -0.3, 0.3),
            "yaw rate": CommandRange("yaw rate", -1.0, 1.0),
        }
    )

    def __init__(self, random_commands: bool = False) -> None:
        super().__init__(random_commands)

    def joint_names(self) -> tuple[str, ...]:
        return tuple(f"{leg} {joint}" for leg in LEGS for joint in ("hip", "thigh", "knee"))


class AnymalForward(Anymal):
    """ANYmal-C whose policy observes the forward command alone: it was never commanded to turn."""

    name = "anymal-forward"
    title = "ANYmal-C, forward only (MuJoCo)"
    description = replace(ANYMAL_DESCRIPTION, observed_commands=1)
    commands = MappingProxyType({"forward": 1.0})
