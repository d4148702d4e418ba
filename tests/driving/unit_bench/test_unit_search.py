"""The search for units that change an attribute from now on."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_simulation import GhostStart
from pdtui.driving.headless_drive import events_of_pressed_keys
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.unit_bench.unit_search_process import choose_best
from pdtui.driving.unit_bench.unit_search_rollouts import rank_candidates, run_search_rollout
from pdtui.driving.unit_bench.unit_search_snapshot import FoundUnit, UnitSearchRequest
from pdtui.driving.unit_bench.unit_searcher import UnitSearcher
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.waiting import wait_until_over


def test_what_is_offered_does_in_the_drive_what_was_measured(small_map: StimulationMap) -> None:
    config = DriveConfig("ant", small_map, seed=3)
    drive = build_control_loop(config)
    for step in range(20):
        drive.advance(events_of_pressed_keys(["w"] if step == 5 else [], drive))
    with UnitSearcher(config, drive) as searcher:
        assert searcher.begin(UnitSearchRequest("vx", 1.0, seconds=1.0), None) == ""
        assert "under way" in searcher.begin(UnitSearchRequest("vx", 1.0), None)
        state = wait_until_over(lambda: searcher.state)
    assert (state.condition, state.step) == ("done", 20)
    assert 1 <= len(state.best) <= 3
    assert all(one.effect > 0.0 for one in state.best)
    start, best = GhostStart(drive.step, drive.copy_state(), drive.robot.digest()), state.best[0]
    column = drive.robot.attribute_index("vx")
    plain = run_search_rollout(drive, start, column, None)
    drive.restore_state(start.state)
    drive.step = start.step
    layer, index = divmod(best.unit, 16)
    measured = []
    for step in range(state.steps):
        pressed = [f"unit {layer}:{index} {best.value!r}"] if step == 0 else []
        record = drive.advance(events_of_pressed_keys(pressed, drive))
        measured += [record.attributes[column]] if step >= state.steps // 2 else []
        if record.ended:
            break
    assert sum(measured) / len(measured) - plain.mean == pytest.approx(best.effect, abs=1e-12)
    drive.robot.close()


def test_the_units_that_change_the_action_most_are_tried_first(small_map: StimulationMap) -> None:
    loop = build_control_loop(DriveConfig("ant", small_map, seed=3))
    loop.advance()
    ranked = rank_candidates(loop, GhostStart(1, loop.copy_state(), loop.robot.digest()), None)
    assert len(ranked) == 2 * loop.policy.units
    assert len({(one.unit, one.value) for one in ranked}) == len(ranked)
    loop.robot.close()


def test_of_two_outputs_of_a_unit_the_better_is_offered_and_falls_come_last() -> None:
    found = [
        FoundUnit(1, 1.0, 0.5, False),
        FoundUnit(1, -1.0, 0.7, False),
        FoundUnit(2, 1.0, 0.9, True),
        FoundUnit(3, 1.0, -2.0, False),
        FoundUnit(4, 1.0, 0.1, False),
    ]
    assert [(one.unit, one.value) for one in choose_best(found, 1.0)] == [(1, -1.0), (4, 1.0), (2, 1.0)]
    assert [one.unit for one in choose_best(found, -1.0)] == [3]


def test_a_robot_that_repeats_its_actions_is_refused(small_map: StimulationMap) -> None:
    loop = build_control_loop(DriveConfig("ant", small_map, seed=3))
    loop.robot.repeats_actions = True
    with UnitSearcher(DriveConfig("ant", small_map, seed=3), loop) as searcher:
        searcher.begin(UnitSearchRequest("vx", 1.0), None)
        assert searcher.state is not None
        assert searcher.state.condition == "failed"
        assert "repeating the episode" in searcher.state.message
        searcher.begin(UnitSearchRequest("sadness", 1.0), None)
        assert "no attribute 'sadness'" in replace(searcher.state).message
    loop.robot.close()
