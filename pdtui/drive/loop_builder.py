"""Build a control loop from a drive's configuration."""

from __future__ import annotations

from pathlib import Path

from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.drive_config import DriveConfig
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_fit import check_fit
from pdtui.policies.weights.import_options import WorldSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot


def build_loop(config: DriveConfig, robot: Robot | None = None, policy: Policy | None = None) -> ControlLoop:
    """Load robot and policy, where they are not given, and set the loop at step 0.

    Raises:
        PdtuiError: the robot, the policy or the map cannot be had, or they do not fit each other.
    """
    robot, wanted = robot or make_robot(config.robot), config.stimulation_map
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
