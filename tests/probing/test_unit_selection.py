"""Units that change the action most are found without trying any on the robot."""

from __future__ import annotations

from pathlib import Path

import torch

from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.unit_selection import select_units_by_action
from pdtui.robots import make_robot
from tests.small_dissection import small_network, write_policy


def test_the_units_that_reach_the_action_are_chosen(tmp_path: Path) -> None:
    network = small_network(3)
    with torch.no_grad():
        network.head.weight.zero_()
        network.head.weight[2, 5] = 0.5  # from unit 1:5
        network.head.weight[6, 1] = 0.01  # a weak component counts as much as a strong one
        # The units of the first layer shall not reach these two.
        network.get_parameter("hidden.1.weight")[[1, 5]] = 0.0
    policy = load_policy(write_policy(tmp_path / "two.safetensors", network), "ant")
    robot = make_robot("ant")
    chosen = select_units_by_action(robot, policy, (-4.0, 4.0), 2, seed=1000, options=None)
    assert chosen == (8 + 1, 8 + 5)
