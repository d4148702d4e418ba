"""The operator in a simple world: it gets past trees, reacts late, and does not press too often."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.core.robot_links_and_state import Link
from pdtui.paper.forest.key_motion_model import KeyMotionModel, RobotMotion, predict_motion
from pdtui.paper.forest.operator_sight import STEPS_PER_FRAME, OperatorSight
from pdtui.paper.forest.scripted_operator import (
    DEFAULT,
    PRESSES_PER_SECOND,
    REACTION_TIME,
    ScriptedOperator,
    operator_keys,
)
from pdtui.pictures.view_ahead import AHEAD
from pdtui.robots.legged.terrain import scatter_trees
from pdtui.stimulation.stimulation_map import StimulationMap

DT = 0.016
BODY = Link("body", 0, "sphere", (0.4,), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
KEY_MODELS = {
    DEFAULT: KeyMotionModel(0.0, 1.4, 0.1, 2.5, 0.8, 0.0, 0.2, 0.0),
    "left": KeyMotionModel(0.7, 1.0, 0.1, 2.0, 0.8, 0.0, 0.2, 0.0),
    "right": KeyMotionModel(-0.7, 1.0, 0.1, 2.0, 0.8, 0.0, 0.2, 0.0),
    "stop": KeyMotionModel(0.0, 1.0, 0.1, 0.1, 0.8, 0.0, 0.2, 0.0),
}
NAMES = list(KEY_MODELS)


def _drive(
    trees: Floats, steps: int, *, driven: bool = True, moved_from: int | None = None, sees_all: bool = True
) -> tuple[Floats, dict[int, str]]:
    """Places before each step, shape (S, 3), and presses by step; from one step on, it sees itself aside."""
    sight, seen = OperatorSight([BODY], trees), trees if sees_all else trees[:0]
    operator = ScriptedOperator(KEY_MODELS, DT)
    place, latched = RobotMotion(0.0, 0.0, 0.0, 0.0), 0
    places, presses = [], {}
    for step in range(steps):
        places.append((place.x, place.y, place.heading))
        aside = 1.0 if moved_from is not None and step >= moved_from else 0.0
        if not sees_all and step % STEPS_PER_FRAME == 0:
            seen = sight.look(np.array([[place.x, place.y, 0.3, *_turned(place.heading)]]))
        if driven and (name := operator.choose_key(place.x, place.y + aside, place.heading, seen)):
            presses[step] = name
            latched = NAMES.index(name)
        _, place = predict_motion(list(KEY_MODELS.values()), place, np.array([[latched]]), DT)
    return np.array(places), presses


def _turned(heading: float) -> tuple[float, float, float, float]:
    return math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)


def _clearance(places: Floats, trees: Floats) -> float:
    away = np.hypot(places[:, None, 0] - trees[:, 0], places[:, None, 1] - trees[:, 1]) - trees[:, 2]
    return float(away.min())


def test_it_gets_past_a_tree_and_back_on_course() -> None:
    trees = np.array([[6.0, 0.05, 0.15]])
    alone, _ = _drive(trees, 300, driven=False)
    driven, presses = _drive(trees, 500)
    assert _clearance(alone, trees) < 0.0
    assert _clearance(driven, trees) > 0.2
    assert driven[-1, 0] > 12.0
    assert abs(driven[-1, 2]) < 0.15
    assert list(presses.values())[-1] == DEFAULT


def test_where_nothing_is_in_the_way_it_presses_nothing() -> None:
    _, presses = _drive(np.array([[6.0, 4.0, 0.15], [9.0, -4.0, 0.15]]), 300)
    assert presses == {}


@pytest.mark.parametrize("seed", [500, 501])
def test_in_a_forest_it_never_presses_more_than_three_keys_in_a_second(seed: int) -> None:
    trees = scatter_trees(np.random.default_rng(seed), 0.15)
    driven, presses = _drive(trees, 500)
    assert _clearance(driven, trees) > 0.1
    steps = np.array(list(presses))
    assert len(steps) > 3
    spans = steps[PRESSES_PER_SECOND:] - steps[:-PRESSES_PER_SECOND]
    assert (spans * DT >= 1.0).all()
    assert _drive(trees, 500)[1] == presses


def test_what_it_sees_moves_it_no_sooner_than_its_reaction_time() -> None:
    trees = np.array([[6.0, 0.05, 0.15], [9.0, 0.7, 0.15], [12.0, -0.4, 0.15]])
    _, presses = _drive(trees, 220)
    changed = []
    for moved_from in range(60, 180, 30):
        _, others = _drive(trees, 220, moved_from=moved_from)
        first = min((step for step, _ in presses.items() ^ others.items()), default=220)
        assert (first - moved_from) * DT >= REACTION_TIME
        changed.append(first)
    assert min(changed) < 220  # it does react


def test_a_tree_that_the_picture_does_not_show_changes_no_key() -> None:
    tree, beside = [6.0, 0.05, 0.3], [[6.5, 2.2, 0.3], [6.5, -2.2, 0.3]]
    alone, among = np.array([tree]), np.array([tree, *beside])
    assert _drive(alone, 120)[1] != _drive(among, 120)[1], "with a wider view they would matter"
    assert _drive(alone, 120, sees_all=False)[1] == _drive(among, 120, sees_all=False)[1]


def test_it_does_not_press_before_a_tree_comes_into_the_picture() -> None:
    trees = np.array([[6.0, 0.05, 0.3]])
    places, presses = _drive(trees, 120, sees_all=False)
    saw = min(presses) - math.ceil(REACTION_TIME / DT)
    assert 6.0 - 0.3 - places[saw, 0] < (0.5 + 0.27) * AHEAD * BODY.size[0] + 1e-9
    assert min(_drive(trees, 120)[1]) < min(presses), "with a wider view it would press sooner"


def test_it_says_which_behaviors_a_map_lacks(small_map: StimulationMap) -> None:
    with pytest.raises(MapError, match="missing: left, right, stop; the map has push, twitch, hold heading"):
        operator_keys(small_map)
    push = small_map.behaviors["push"]
    names = {"left": "a", "right": "d", "stop": "x", "forward": "u"}
    known = replace(
        small_map, behaviors={name: replace(push, name=name, key=key) for name, key in names.items()}
    )
    assert operator_keys(known) == {DEFAULT: "space", **names}
