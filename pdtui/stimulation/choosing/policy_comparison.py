"""Compares a policy with the one that a map was made for."""

from __future__ import annotations

from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import RobotSpec, open_robot
from pdtui.stimulation.stimulation_map import StimulationMap


def is_of_another_policy(
    stimulation_map: StimulationMap, robot: RobotSpec, policy: str, import_options: ImportOptions = NO_OPTIONS
) -> bool:
    """Return whether a map was made for another policy of a robot than the one of this file or name.

    Raises:
        PdtuiError: The robot or the policy cannot be loaded.
    """
    with open_robot(robot) as world:
        spaces = ObservationActionSpaces.of_world(world)
    given = load_policy(policy, robot.name, import_options=import_options, spaces=spaces)
    return given.sha256 != stimulation_map.policy_hash
