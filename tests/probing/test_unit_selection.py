"""Outputs of units that push the action most are found without trying any on the robot."""

from __future__ import annotations

from pathlib import Path

import torch

from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.unit_selection import select_outputs_by_action_change
from pdtui.robots import make_robot
from tests.small_dissection import small_network, write_policy


def test_outputs_that_reach_the_action_are_chosen(tmp_path: Path) -> None:
    network = small_network(3)
    with torch.no_grad():
        network.head.weight.zero_()
        network.head.weight[2, 5] = 0.5  # from unit 1:5
        network.head.weight[6, 1] = 0.01  # a weak component counts as much as a strong one
        # The units of the first layer shall not reach these two.
        network.get_parameter("hidden.1.weight")[[1, 5]] = 0.0
    policy = load_policy(write_policy(tmp_path / "two.safetensors", network), "ant")
    robot = make_robot("ant")
    chosen = select_outputs_by_action_change(robot, policy, (-4.0, 4.0), 16, seed=1000, options=None)
    # The head's weights are positive, so each unit pushes its component up at 4 and down at −4.
    assert {(8 + 5, 4.0), (8 + 5, -4.0), (8 + 1, 4.0), (8 + 1, -4.0)} <= set(chosen)


def test_each_component_is_pushed_both_ways() -> None:
    robot, policy = make_robot("walker"), load_policy("walker")
    chosen = select_outputs_by_action_change(robot, policy, (-4.0, 4.0), 24, seed=1000, options=None)
    assert len(chosen) <= 24
    assert {value for _, value in chosen} == {-4.0, 4.0}
