"""Builds a control loop from the configuration of a drive, or sends what that needs to a cluster."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from torch import nn

from pdtui.core.cluster.ray_cluster import RayCluster, Workers
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_compatibility import check_policy_fit
from pdtui.policies.weights.cluster_policy_files import send_policy_files
from pdtui.policies.weights.import_options import ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.stimulation.map_robot_options import map_robot


def build_control_loop(
    config: DriveConfig, robot: Robot | None = None, policy: Policy | nn.Module | None = None
) -> ControlLoop:
    """Return a loop before its first step; the robot and the policy are loaded unless they are given.

    Those that cannot be loaded, or do not fit each other or the map, raise a `PdtuiError`.
    """
    stimulation_map = config.stimulation_map
    robot = robot or make_robot(map_robot(stimulation_map, config.robot))
    if isinstance(policy, nn.Module):
        policy = policy_from_network(policy, robot.observation_space, robot.action_space)
    policy = policy or load_policy(
        config.policy or stimulation_map.policy,
        config.robot,
        import_options=stimulation_map.import_options,
        spaces=ObservationActionSpaces.of_world(robot),
        folders=(Path(stimulation_map.source).parent,),
    )
    stimulation_map.check(config.robot, policy.layers, policy.sha256, force=config.force)
    check_policy_fit(policy, robot, config.robot)
    return ControlLoop(
        robot, policy, stimulation_map, config.seed, stochastic=config.stochastic, start=config.start
    )


def send_drive_files(workers: Workers, config: DriveConfig) -> DriveConfig:
    """Send the files that a drive needs to a cluster, and return the drive with their names there.

    The map is part of the configuration. For worker processes of this machine, nothing changes.

    Raises:
        PolicyError: The drive's policy does not exist.
    """
    if not isinstance(workers, RayCluster):
        return config
    own = config.stimulation_map
    name, options = send_policy_files(
        workers, config.policy or own.policy, own.import_options, (Path(own.source).parent,)
    )
    return replace(config, policy=name, stimulation_map=replace(own, import_options=options))
