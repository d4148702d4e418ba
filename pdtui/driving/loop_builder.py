"""Building a control loop from a drive's configuration."""

from __future__ import annotations

from pathlib import Path

from torch import nn

from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_fit import check_fit
from pdtui.policies.weights.import_options import WorldSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot


def build_loop(
    config: DriveConfig, robot: Robot | None = None, policy: Policy | nn.Module | None = None
) -> ControlLoop:
    """Load the robot and the policy, unless they are given, and set the loop to step 0.

    Raises:
        PdtuiError: robot, policy or map cannot be loaded or do not fit each other.
    """
    robot, wanted = robot or make_robot(config.robot), config.stimulation_map
    if isinstance(policy, nn.Module):
        policy = policy_from_network(policy, robot.observation_space, robot.action_space)
    policy = policy or load_policy(
        config.policy or wanted.policy,
        config.robot,
        import_options=wanted.import_options,
        spaces=WorldSpaces.of_world(robot),
        folders=(Path(wanted.source).parent,),
    )
    wanted.check(config.robot, policy.layers, policy.sha256, force=config.force)
    check_fit(policy, robot, config.robot)
    return ControlLoop(robot, policy, wanted, config.seed, stochastic=config.stochastic, start=config.start)
