"""Chooses the map of a drive: the one that is named, the robot's own, or none for a policy alone."""

from __future__ import annotations

from pathlib import Path

from torch import nn

from pdtui.core.errors import MapError
from pdtui.policies.runtime.live_network import hash_network
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.robots import RobotSpec, robot_file_stem
from pdtui.stimulation.choosing.policy_comparison import is_of_another_policy
from pdtui.stimulation.map_library import find_map, map_without_behaviors
from pdtui.stimulation.map_policy_lookup import resolve_map_policy
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import StimulationMap

GivenPolicy = str | Path | nn.Module | Policy | None


def choose_drive_map(
    robot: str,
    given: str | Path | StimulationMap | None,
    policy: GivenPolicy,
    import_options: ImportOptions,
    *,
    force: bool = False,
) -> StimulationMap:
    """Return the map of a drive, with its policy.

    A policy that is given without a map drives alone where the robot has no map of its own, or has one for
    another policy, unless that is forced.

    Raises:
        PdtuiError: There is no such map, or its policy cannot be found.
    """
    named = str(policy) if isinstance(policy, str | Path) else ""
    if isinstance(given, StimulationMap):
        return resolve_map_policy(given, named, import_options)
    try:
        found = load_map(find_map(str(given) if given else robot_file_stem(robot)))
    except MapError:
        if given or policy is None:
            raise
        return _map_of_policy_alone(robot, policy, named, import_options)
    alone = policy is not None and not given and not force
    if alone and _is_for_another(found, robot, policy, named, import_options):
        return _map_of_policy_alone(robot, policy, named, import_options)
    return resolve_map_policy(found, named, import_options)


def _is_for_another(
    found: StimulationMap, robot: str, policy: GivenPolicy, named: str, import_options: ImportOptions
) -> bool:
    if named:
        return is_of_another_policy(found, RobotSpec(robot, found.robot_options), named, import_options)
    assert isinstance(policy, nn.Module | Policy)
    sha256 = policy.sha256 if isinstance(policy, Policy) else hash_network(policy)
    return sha256 != found.policy_hash


def _map_of_policy_alone(
    robot: str, policy: GivenPolicy, named: str, import_options: ImportOptions
) -> StimulationMap:
    in_memory = policy.name if isinstance(policy, Policy) else type(policy).__name__
    return resolve_map_policy(map_without_behaviors(robot, named or in_memory), named, import_options)
