"""Directions of the last layer: what they move, and that the shipped ones are those of their outputs."""

from __future__ import annotations

import numpy as np
import pytest
from torch import nn

import pdtui
from pdtui.core.errors import PolicyError
from pdtui.core.units import Stimulation
from pdtui.dissection.steering.output_layer_directions import (
    find_output_direction,
    solve_coordinates_for_outputs,
)
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.interventions.unit_edits import AddToUnits, SetCoordinates
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map

ACTIONS = 12
CROUCH = dict(
    enumerate([0.002, 0.049, 0.053, -0.05, 0.239, -0.043, 0.033, -0.17, 0.051, -0.365, 0.325, -0.194])
)


def test_a_direction_moves_the_outputs_that_it_is_for_and_no_other() -> None:
    policy, robot = pdtui.load_policy("cassie"), make_robot("cassie")
    observation, _ = robot.reset(seed=1600)
    for _ in range(120):
        observation, *_ = robot.step(policy.act(observation).action)
    added = find_output_direction(policy, {3: 0.2, 10: -0.1}, ACTIONS)
    units = np.arange(policy.units - policy.layers[-1], policy.units)
    pushed = policy.act(observation, Stimulation(edits=(AddToUnits(units, added),))).action
    # The actions are 3 tanh of the network's output.
    before, after = (np.arctanh(one / 3.0) for one in (policy.act(observation).action, pushed))
    expected = np.zeros(ACTIONS)
    expected[[3, 10]] = 0.2, -0.1
    near = np.abs(before) < 2.0  # where float32 still tells tanh from 1
    assert near[[3, 10]].all()
    assert near.sum() > 6
    np.testing.assert_allclose((after - before)[near], expected[near], atol=1e-3)


@pytest.mark.parametrize(("name", "changes"), [("left knee", {3: 1.0}), ("crouch", CROUCH)])
def test_the_shipped_directions_are_those_of_the_outputs_that_they_name(
    name: str, changes: dict[int, float]
) -> None:
    direction = find_output_direction(pdtui.load_policy("cassie"), changes, ACTIONS)
    np.testing.assert_allclose(load_map(find_map("cassie")).vectors[name].rows[0], direction, atol=1e-5)


def test_coordinates_set_what_the_network_puts_out() -> None:
    policy, robot = pdtui.load_policy("cassie"), make_robot("cassie")
    observation, _ = robot.reset(seed=1600)
    wanted = np.linspace(-1.5, 1.5, ACTIONS)
    vectors, coordinates = solve_coordinates_for_outputs(policy, wanted.tolist())
    np.testing.assert_allclose(load_map(find_map("cassie")).vectors["outputs"].rows, vectors, atol=1e-5)
    units = np.arange(policy.units - policy.layers[-1], policy.units)
    edit = SetCoordinates(units, vectors.astype(np.float32), coordinates)
    posed = policy.act(observation, Stimulation(edits=(edit,))).action
    np.testing.assert_allclose(posed, 3.0 * np.tanh(wanted), atol=1e-3)


def test_an_output_that_is_not_there_is_refused() -> None:
    policy = Policy(nn.Sequential(nn.Linear(2, 5), nn.Tanh(), nn.Linear(5, 3)), 2, name="small")
    assert find_output_direction(policy, {2: 1.0}, 3).shape == (5,)
    with pytest.raises(PolicyError, match="small: expected an index of outputs below 3, found 3"):
        find_output_direction(policy, {3: 1.0}, 3)
    with pytest.raises(PolicyError, match="small: expected a linear layer at its end, from 5 units to 4"):
        find_output_direction(policy, {0: 1.0}, 4)
