"""Outputs of units that push the action most are found without trying any on the robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.unit_selection import choose_primitive_candidates, select_outputs_by_action_change
from pdtui.robots import make_robot
from pdtui.spectra.matching import UnitDiscrepancies
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


def test_a_brake_is_a_unit_that_stands_out_not_an_output_at_which_half_of_all_units_brake() -> None:
    values, starts = (-8.0, -2.0, 2.0, 8.0), 3
    effects = np.zeros((10, len(values), starts, 1))
    effects[:, 0] = np.linspace(-1.4, 0.0, 10)[:, None, None]  # at −8, many units brake, 0:0 most
    effects[7, 1], effects[7, 0] = -1.0, -1.2  # at −2, only this one does
    screen = UnitEffects(
        tuple(range(10)),
        values,
        effects,
        np.zeros((10, 4, starts), bool),
        np.ones((starts, 1)),
        np.zeros(3, bool),
    )
    matching = UnitDiscrepancies(np.linspace(1.0, 2.0, 10)[None], np.zeros((1, 10)), (), (), {})
    first, best = choose_primitive_candidates(screen, screen, matching, [0], values, 1)
    assert (best.unit, best.value, best.sign) == (7, -2.0, -1.0)
    # The first match is judged, too, whatever it does: here, at its only effect.
    assert (first.unit, first.value) == (0, -8.0)


def test_each_component_is_pushed_both_ways() -> None:
    robot, policy = make_robot("walker"), load_policy("walker")
    chosen = select_outputs_by_action_change(robot, policy, (-4.0, 4.0), 24, seed=1000, options=None)
    assert len(chosen) <= 24
    assert {value for _, value in chosen} == {-4.0, 4.0}
