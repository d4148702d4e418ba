"""Dissection of a convolutional policy with discrete actions and of one with memory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pdtui.core.units import NO_STIMULATION, Stimulation, parse_unit
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.start_states import StartState, collect_start_states
from pdtui.probing.stimulated_rollout import run_rollout
from pdtui.robots.robot import Robot
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset
from tests.small_worlds import Dot, Pole, dot_policy, pole_policy, trained_conv

WORLDS = [(Dot, dot_policy), (Pole, pole_policy)]


@pytest.mark.parametrize(("world", "network"), WORLDS)
def test_every_unit_is_monitored_and_matched(
    world: Callable[[], Robot], network: Callable[[], Policy]
) -> None:
    robot, policy = world(), network()
    episodes = monitor_episodes(robot, policy, range(3), 130)
    assert [episode.activations.shape for episode in episodes] == [(130, policy.units)] * 3
    found = match_units(episodes, robot.attributes, find_matching_preset("paper"))
    assert found.discrepancy.shape == (len(robot.attributes), policy.units)
    assert np.isfinite(found.discrepancy).all()
    again = monitor_episodes(robot, policy, [1], 130)
    np.testing.assert_array_equal(again[0].activations, episodes[1].activations)


@pytest.mark.parametrize(("world", "network"), WORLDS)
def test_a_roll_out_from_a_start_goes_on_as_the_walk_did(
    world: Callable[[], Robot], network: Callable[[], Policy]
) -> None:
    robot, policy = world(), network()
    starts = collect_start_states(robot, policy, 5, 2, at=30)
    robot.reset(seed=5)
    policy.reset()
    values = []
    for _ in range(50):
        robot.step(policy.act(robot.observe()).action)
        values.append(robot.read_attributes())
    for _ in range(2):
        outcome = run_rollout(robot, policy, starts[0], NO_STIMULATION, 20, 10)
        np.testing.assert_allclose(outcome.means, np.mean(values[40:], axis=0), atol=1e-12)


def test_without_its_memory_the_start_is_another() -> None:
    robot, policy = Pole(), pole_policy()
    (start,) = collect_start_states(robot, policy, 5, 1, at=4)
    forgotten = StartState(
        start.seed, start.step, start.snapshot, tuple(0 * array for array in start.policy_state)
    )
    means = [run_rollout(robot, policy, one, NO_STIMULATION, 10, 5).means for one in (start, forgotten)]
    assert not np.array_equal(means[0], means[1])


def test_a_unit_that_favors_a_move_makes_it() -> None:
    robot, policy = Dot(), dot_policy()
    weight = trained_conv().logits.weight.detach().numpy()
    left_minus_right = weight[1] - np.delete(weight, 1, axis=0).max(axis=0)
    unit = int(np.argmax(left_minus_right))
    assert left_minus_right[unit] > 0
    (start,) = collect_start_states(robot, policy, 0, 1, at=10)
    flat = parse_unit(f"fc:{unit}", policy.layers)
    pushed = run_rollout(robot, policy, start, Stimulation((flat,), (60.0,)), 20, 10)
    assert pushed.means[0] == 0.0
