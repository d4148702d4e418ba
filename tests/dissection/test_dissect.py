from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from functools import partial
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from pdtui.api import dissect
from pdtui.core.errors import MapError
from pdtui.core.units import Stimulation
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_searches import DissectionSearches
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.dissection.dissection_text import render_dissection
from pdtui.dissection.draft_map import draft_map
from pdtui.policies.weights.weights_header import hash_file
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.matching_hits import rank_correlation
from pdtui.probing.measured_effects import PlanEffects
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.robots.robot_goals import WALKING_GOALS
from pdtui.search.behavior_search import BehaviorSearchResult, SearchStartStates
from pdtui.search.controller_search import ControllerSearchResult
from pdtui.search.evolutionary_search import SharedTimeBudget
from pdtui.search.goal_scores import measure_goal_gains, score_plans_by_goal
from pdtui.spectra.matching_presets import PRESETS, find_matching_preset, list_preset_values
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import MeasuredEffect, PidGains
from tests.small_dissection import SMALL

GOALS = WALKING_GOALS.behaviors


def test_every_unit_is_screened_and_every_goal_has_a_candidate(dissection: Dissection) -> None:
    assert dissection.screen.units == tuple(range(16))
    assert [found.goal.name for found in dissection.behaviors] == [goal.name for goal in GOALS]
    assert all(1 <= len(found.stimulation.units) <= 3 for found in dissection.behaviors)
    assert {held.pid.attribute for held in dissection.controllers} == {"yaw", "speed"}


def test_the_result_does_not_depend_on_the_workers(dissection: Dissection, policy_file: Path) -> None:
    again = dissect("ant", policy_file, episodes=2, workers=1, settings=SMALL)
    np.testing.assert_array_equal(again.screen.effects, dissection.screen.effects)
    assert again.behaviors == dissection.behaviors
    assert again.controllers == dissection.controllers
    assert draft_map(again) == draft_map(dissection)


def test_summary_is_json_and_names_what_was_asked(dissection: Dissection, policy_file: Path) -> None:
    summary = json.loads(json.dumps(summarize_dissection(dissection), allow_nan=False))
    assert summary["sha256"] == hash_file(policy_file)
    vx = summary["attributes"][0]
    assert vx["name"] == "vx"
    best = dissection.matching.discrepancy[0].min()
    assert vx["matches"][0]["discrepancy"] == pytest.approx(best)


def test_summary_holds_every_setting_and_the_whole_match(dissection: Dissection) -> None:
    summary = summarize_dissection(dissection)
    assert summary["settings"] == list_preset_values(PRESETS["paper"])
    assert summary["settings_changed"] == []
    keys = {"unit", "flaw", "discrepancy", "level_share", "rho", "rho_circular", "rho_disagree"}
    for attribute in summary["attributes"]:
        assert len(attribute["matches"]) == 10
        assert all(one.keys() == keys for one in attribute["matches"])


def test_a_silent_unit_and_a_broken_attribute_are_marked_rows(dissection: Dissection) -> None:
    discrepancy = dissection.matching.discrepancy.copy()
    discrepancy[0], discrepancy[1, 9] = np.nan, 0.0
    matching = replace(
        dissection.matching,
        discrepancy=discrepancy,
        flaws={"vx": "not finite in the episodes of seeds [1000]; left out"},
        unit_flaws={9: "never fires"},
    )
    broken = replace(dissection, matching=matching, preset=find_matching_preset("paper", ["hop=8"]))
    summary = json.loads(json.dumps(summarize_dissection(broken), allow_nan=False))
    assert summary["settings_changed"] == ["hop=8"]
    assert summary["unit_flaws"] == {"1:1": "never fires"}
    vx, vy = summary["attributes"][:2]
    assert (vx["frequency"], vx["matches"]) == (None, [])
    assert (vy["matches"][0]["unit"], vy["matches"][0]["flaw"]) == ("1:1", "never fires")
    screen = StringIO()
    Console(file=screen, width=220).print(render_dissection(broken))
    for text in (
        "Matching (paper hop=8)",
        "1:1 †",
        "vx: not finite in the episodes of seeds [1000]; left out.",
        "† 1 of the units: never fires (1:1).",
    ):
        assert text in screen.getvalue()


def test_report_shows_every_attribute_and_behavior(dissection: Dissection) -> None:
    screen = StringIO()
    Console(file=screen, width=220).print(render_dissection(dissection))
    for name in (
        "yaw rate",
        "front left hip torque",
        "spin left",
        "Unwrapped before the transform: yaw, roll",
    ):
        assert name in screen.getvalue()


def test_a_small_trembling_ant_gets_no_behavior_and_the_map_says_so(dissection: Dissection) -> None:
    text = draft_map(dissection)
    parsed = tomllib.loads(text)
    reached = [found.goal.name for found in dissection.behaviors if found.reached]
    held = ["hold heading" for held in dissection.controllers if held.holds]
    names = [behavior["name"] for behavior in parsed.get("behaviors", [])]
    assert names[: len(reached) + len(held)] == reached + held
    for found in dissection.behaviors:
        assert (f"# Not found: {found.goal.name}." in text) == (found.goal.name not in reached)


def test_what_was_found_is_in_the_map(dissection: Dissection) -> None:
    sure = MeasuredEffect(1.2, 1.0, 1.4)
    up = BehaviorSearchResult(
        GOALS[1], Stimulation((3, 9), (-2.5, 4.0)), 1.5, 1.6, sure, sure, 1.0, 0.0, 1.2, 0.0, 10,
        Stimulation((4, 8), (1.5, 2.0)), 0.1, 0.01,
    )  # fmt: skip
    held = ControllerSearchResult(
        Stimulation((9,), (-1.0,)), PidGains("yaw", 6.0, 0.0, 0.0, 4.0, 0.2), 0.1, 0.6, 0.0, (-0.4, 0.4), True
    )
    text = draft_map(replace(dissection, behaviors=(up,), controllers=(held,)))
    parsed = tomllib.loads(text)
    parse_map(text, "proposed").check("ant", dissection.layers, dissection.policy_hash)
    assert parsed["schema"] == 1
    assert parsed["policy"]["sha256"] == dissection.policy_hash
    first, second = parsed["behaviors"][:2]
    assert (first["name"], first["key"]) == ("up", "w")
    assert first["measured"] == {"effect": 1.2, "low": 1.0, "high": 1.4}
    assert first["aim"] == {"attribute": "vy", "direction": "increase"}
    units = {entry["name"]: (entry["unit"], entry["rho"]) for entry in parsed.get("primitives", [])}
    outputs = {}
    for name, magnitude in first["magnitudes"].items():
        unit, rho = units.get(name, (name, 1.0))
        outputs[unit] = magnitude * rho
    assert outputs == {"0:3": pytest.approx(-2.5), "1:1": pytest.approx(4.0)}
    assert second["mode"] == "pid"
    assert second["magnitudes"] == {"1:1": -1.0}
    assert second["pid"] == {"attribute": "yaw", "kp": 6.0, "ki": 0.0, "kd": 0.0, "limit": 4.0, "step": 0.2}


def test_a_primitive_carries_what_was_measured(dissection: Dissection) -> None:
    for entry in tomllib.loads(draft_map(dissection)).get("primitives", []):
        assert entry["measured"]["low"] * entry["measured"]["high"] > 0
        assert entry["value"] in SMALL.screen_values


def test_a_budget_that_is_over_still_screens(policy_file: Path) -> None:
    quick = dissect("ant", policy_file, episodes=1, workers=1, settings=SMALL, budget_minutes=0.0)
    assert len(quick.screen.units) == 16
    assert len(quick.behaviors) == len(GOALS)
    assert quick.controllers == ()


def effects(means: list[list[float]], falls: list[list[bool]], unperturbed: list[float]) -> PlanEffects:
    stimulated, without = np.array(means)[..., None], np.array(unperturbed)[:, None]
    return PlanEffects(
        stimulated - without,
        stimulated,
        without,
        np.array(falls),
        np.full(stimulated.shape, np.nan),
        np.zeros(stimulated.shape[1], np.bool_),
    )


def test_a_stop_gains_the_share_of_the_speed_that_is_gone() -> None:
    stop = GOALS[0]
    result = effects([[0.0, 1.0, 3.0]], [[False, False, False]], [4.0, 2.0, 2.0])
    np.testing.assert_allclose(measure_goal_gains(stop, 0, result), [[1.0, 0.5, -0.5]])


def test_scores_want_every_start_and_no_falls() -> None:
    up, down = GOALS[1], GOALS[2]
    never = [[False] * 5] * 2
    result = effects([[0.7] * 5, [2.0, 2.0, 2.0, 0.0, 0.0]], never, [0.0] * 5)
    # By hand: halfway between mean (0.7 and 1.2) and lower fifth (0.7 and 0), in parts of 0.7.
    np.testing.assert_allclose(score_plans_by_goal(up, 0, result, [1, 1]), [1.0, 0.6 / 0.7])
    np.testing.assert_allclose(score_plans_by_goal(up, 0, result, [4, 4]), [0.96, 0.6 / 0.7 - 0.04])
    assert score_plans_by_goal(down, 0, result, [1, 1])[0] == pytest.approx(-1.0)
    fell = effects([[1.4] * 5], [[True, False, False, False, False]], [0.0] * 5)
    np.testing.assert_allclose(measure_goal_gains(up, 0, fell), [[0.0, 1.4, 1.4, 1.4, 1.4]])


def test_rank_correlation() -> None:
    a = np.array([1.0, 2.0, 3.0, 4.0])
    assert rank_correlation(a, np.exp(a)) == pytest.approx(1.0)
    assert rank_correlation(a, -a) == pytest.approx(-1.0)
    # By hand, ranks 1 2 3 4 and 1.5 1.5 4 3: covariance 3.5, variances 5 and 4.5.
    assert rank_correlation(a, np.array([0.0, 0.0, 9.0, 5.0])) == pytest.approx(3.5 / np.sqrt(5 * 4.5))
    assert np.isnan(rank_correlation(a, np.zeros(4)))


def test_searches_begin_from_a_maps_behaviors(policy_file: Path, tmp_path: Path) -> None:
    text = f"""
schema = 1
robot = "ant"
policy = {{ name = "{policy_file}", sha256 = "{hash_file(policy_file)}" }}
[[behaviors]]
name = "lean"
key = "l"
magnitudes = {{ "0:3" = 9.5, "1:7" = -9.5 }}
"""
    known = Stimulation((3, 15), (9.5, -9.5))
    effort = replace(
        SMALL,
        screen_steps=4,
        refine_steps=4,
        held_steps=4,
        mover_steps=3,
        behavior_search=replace(
            SMALL.behavior_search, random_sets=1, single_units=0, children=8, promoted=8, elite=8
        ),
    )
    with RolloutPool("ant", policy_file, 1) as crew:
        starts = collect_start_states(crew.robot, crew.policy, 1200, 1, at=5)
        searches = DissectionSearches(
            EffectProbe(crew), crew.robot, effort, 1000, SharedTimeBudget(None), lambda _: None, (known,)
        )
        assert known in searches.probe_shared_candidates(SearchStartStates(tuple(starts), (), ())).plans
    path = tmp_path / "mine.toml"
    path.write_text(text)
    quick = partial(dissect, "ant", policy_file, episodes=1, workers=1, settings=effort, budget_minutes=0.0)
    found, alone = quick(start_from=str(path)), quick()
    assert found.rollouts > alone.rollouts
    with pytest.raises(MapError, match="unit 1:70 does not exist"):
        quick(start_from=parse_map(text.replace("1:7", "1:70"), "mine"))
