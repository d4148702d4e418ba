"""What stands in for a behavior's units, against plain computation."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.units import Stimulation
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.evaluation.behavior_substitutes import (
    ActionShift,
    InterventionSize,
    RandomDirection,
    draw_random_direction,
    draw_random_units,
)
from pdtui.evaluation.held_run import HeldRunPlan, drive_held_run, measure_intervention
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.turning_robot import turning_loop

TIMES = RunTimes(press=20, held=20, after=10, window=10, bin=5, dt=0.05)
PUSHED = Stimulation((3, 16 + 7), (-2.0, 2.0))


@pytest.fixture(scope="module")
def loop(small_map: StimulationMap) -> ControlLoop:
    return build_control_loop(DriveConfig("ant", small_map, 0))


def test_random_units_are_others_of_the_same_layers_at_the_same_dose() -> None:
    own = Stimulation((1, 2, 20), (-4.0, 3.0, 8.0))
    seen = set()
    for draw in range(40):
        drawn = draw_random_units(own, (16, 16), "push", draw).stimulation
        assert not set(drawn.units) & set(own.units)
        assert [unit // 16 for unit in drawn.units] == [0, 0, 1]
        assert sorted(map(abs, drawn.values)) == [3.0, 4.0, 8.0]
        seen.add(drawn)
    assert len(seen) > 30
    assert draw_random_units(own, (16, 16), "push", 3) == draw_random_units(own, (16, 16), "push", 3)
    assert draw_random_units(own, (16, 16), "pull", 3) != draw_random_units(own, (16, 16), "push", 3)
    whole = Stimulation.of(dict.fromkeys(range(3), 1.0))
    assert len(draw_random_units(whole, (3,), "push", 0).stimulation.units) == 3  # there are no others


def test_a_random_direction_is_as_long_as_the_behaviors_own_change(policy: Policy) -> None:
    drawn = draw_random_direction(InterventionSize({0: 2.5, 1: 0.5}, ()), (16, 16), "push", 0)
    assert [np.linalg.norm(drawn.added[layer]) for layer in (0, 1)] == pytest.approx([2.5, 0.5])
    observation = np.random.default_rng(1).normal(size=27)
    natural = policy.act(observation).activations
    only_lower = RandomDirection({0: drawn.added[0]})
    moved = only_lower.act(policy, make_robot("ant"), observation).activations
    assert moved[:16] - natural[:16] == pytest.approx(drawn.added[0], abs=1e-5)
    assert np.abs(moved[16:] - natural[16:]).max() > 0.01
    both = drawn.act(policy, make_robot("ant"), observation).activations
    assert both[16:] - moved[16:] == pytest.approx(drawn.added[1], abs=1e-5)


def test_the_push_is_measured_where_the_behavior_is_held(loop: ControlLoop, policy: Policy) -> None:
    robot = make_robot("ant")
    observation, _ = robot.reset(seed=5)
    shifts, squares = [], []
    for step in range(30):
        natural = policy.act(observation)
        acted = policy.act(observation, PUSHED) if step >= 20 else natural
        if step >= 20:
            shifts.append(acted.action - natural.action)
            squares.append((acted.activations[3] - natural.activations[3]) ** 2)
        observation, *_ = robot.step(acted.action)
    found = measure_intervention(loop, HeldRunPlan("push", 5, TIMES)).size
    assert found is not None
    assert found.action == pytest.approx(np.mean(shifts, axis=0), abs=1e-6)
    assert found.layers[0] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-5)
    assert set(found.layers) == {0, 1}
    assert measure_intervention(loop, HeldRunPlan("", 5, TIMES)).size is None


def test_an_intervention_is_measured_and_replaced_as_constants_are(map_text: str) -> None:
    text = (
        map_text
        + """
[[behaviors]]
name = "nudge"
key = "k"
aim = { attribute = "vy", direction = "increase" }
[[behaviors.interventions]]
kind = "add"
values = { "0:3" = 0.3, "0:4" = -0.4 }
"""
    )
    loop = build_control_loop(DriveConfig("ant", parse_map(text, "m"), 0))
    found = measure_intervention(loop, HeldRunPlan("nudge", 5, TIMES)).size
    assert found is not None
    assert found.layers == {0: pytest.approx(0.5, rel=1e-5)}
    shift = ActionShift(found.action)
    records = list(drive_held_run(loop, HeldRunPlan("nudge", 5, TIMES, substitute=shift)))
    held = slice(TIMES.press, TIMES.press + TIMES.held)
    assert not any(record.stimulation.units for record in records[held])


def test_a_substitute_acts_only_while_the_behavior_is_held() -> None:
    loop = turning_loop()
    records = list(drive_held_run(loop, HeldRunPlan("turn", 1, TIMES, substitute=ActionShift((0.25, -0.5)))))
    assert len(records) == TIMES.steps
    for record in records:
        held = TIMES.press <= record.step < TIMES.press + TIMES.held
        assert record.action.tolist() == ([0.25, -0.5] if held else [0.0, 0.0])


def test_a_push_stays_within_the_range_of_actions() -> None:
    loop = turning_loop()
    records = list(drive_held_run(loop, HeldRunPlan("turn", 1, TIMES, substitute=ActionShift((0.0, 9.0)))))
    assert max(record.action[1] for record in records) == 4.0
