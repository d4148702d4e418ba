"""The operator of a course: it acts late, presses no faster than a person, and knows what to do where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.errors import MapError
from pdtui.paper.parkour.course_operator import (
    NEEDED_BEHAVIORS,
    PRESSES_PER_SECOND,
    REACTION_TIME,
    CourseOperator,
    CourseView,
)
from pdtui.robots.parkour.parkour_course import ObstacleKind, ParkourObstacle
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import StimulationMap

DT, SPEED = 0.02, 1.0


@pytest.fixture(scope="module")
def cassie_map() -> StimulationMap:
    return load_map(find_map("cassie"))


def _walk(
    operator: CourseOperator, kind: ObstacleKind, place: float, *, opening: float = 0.0, y: float = 0.0
) -> dict[int, str]:
    """Walk straight on toward an obstacle for 6 s and return the keys by control step."""
    obstacle = ParkourObstacle(kind, place, np.zeros((1, 6)), opening)
    views = [CourseView(SPEED * DT * step, y, obstacle, True, 1) for step in range(300)]
    return {step: key for step, view in enumerate(views) if (key := operator.choose_key(view))}


@pytest.mark.parametrize(
    ("kind", "behavior"), [("bar", "duck"), ("closing door", "hurry"), ("opening door", "stop")]
)
def test_it_does_what_an_obstacle_asks_for_before_it_is_there(
    cassie_map: StimulationMap, kind: ObstacleKind, behavior: str
) -> None:
    keys = _walk(CourseOperator(cassie_map, DT), kind, 5.0)
    step, key = next(iter(keys.items()))
    assert key == cassie_map.behaviors[behavior].key
    assert 1.0 < step * DT * SPEED < 4.6


@pytest.mark.parametrize(("opening", "behavior"), [(1.2, "sidestep left"), (-1.2, "sidestep right")])
def test_it_steps_aside_to_a_gates_opening(cassie_map: StimulationMap, opening: float, behavior: str) -> None:
    keys = _walk(CourseOperator(cassie_map, DT), "gate", 5.0, opening=opening)
    assert next(iter(keys.values())) == cassie_map.behaviors[behavior].key
    assert not _walk(CourseOperator(cassie_map, DT), "gate", 5.0, opening=opening, y=opening)


def test_it_sees_late(cassie_map: StimulationMap) -> None:
    obstacle = ParkourObstacle("opening door", 1.0, np.zeros((1, 6)))
    open_door = CourseView(0.5, 0.0, obstacle, False, 1)
    operator = CourseOperator(cassie_map, DT)
    assert not any(operator.choose_key(open_door) for _ in range(100))
    closed, waited = replace(open_door, closed=True), 0
    while not operator.choose_key(closed):
        waited += 1
    assert REACTION_TIME <= waited * DT <= REACTION_TIME + 0.1


def test_it_presses_at_most_three_keys_a_second(cassie_map: StimulationMap) -> None:
    operator, pressed = CourseOperator(cassie_map, DT), []
    obstacle = ParkourObstacle("gate", 50.0, np.zeros((1, 6)))
    for step in range(1000):
        side = 2.0 if (step // 6) % 2 else -2.0
        if operator.choose_key(CourseView(0.0, side, obstacle, True, 1)):
            pressed.append(step)
    assert len(pressed) > 10
    for first, fourth in zip(pressed, pressed[PRESSES_PER_SECOND:], strict=False):
        assert (fourth - first) * DT >= 1.0


def test_a_map_without_what_it_needs_is_refused(cassie_map: StimulationMap) -> None:
    less = {name: one for name, one in cassie_map.behaviors.items() if name != "duck"}
    with pytest.raises(
        MapError, match=f"needs a behavior for each of {', '.join(NEEDED_BEHAVIORS)}; missing: duck"
    ):
        CourseOperator(replace(cassie_map, behaviors=less), DT)
