"""Courses are functions of the seed, have every kind of obstacle, and none leaves the straight way open."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from pdtui.robots.parkour.parkour_course import (
    CLOSING_TIME,
    COUNT,
    HALF_WIDTH,
    LENGTH,
    OBSTACLE_KINDS,
    OPENING_TIME,
    OPENING_WIDTH,
    ParkourObstacle,
    sample_parkour_course,
)

COURSES = {seed: sample_parkour_course(np.random.default_rng(seed)) for seed in range(50)}


@pytest.mark.parametrize("seed", COURSES)
def test_a_course_has_every_kind_of_obstacle_with_room_between_them(seed: int) -> None:
    course = COURSES[seed]
    assert len(course) == COUNT
    assert {one.kind for one in course} == set(OBSTACLE_KINDS)
    places = np.array([one.place for one in course])
    assert (np.diff(places) >= 4.0).all()
    assert places[0] >= 4.0
    assert course[-1].end < LENGTH
    for one, following in pairwise(course):
        assert one.end <= following.sensor


def test_a_course_is_a_function_of_the_seed() -> None:
    again = sample_parkour_course(np.random.default_rng(3))
    assert [(one.kind, one.place, one.opening) for one in again] == [
        (one.kind, one.place, one.opening) for one in COURSES[3]
    ]
    kinds = {tuple(one.kind for one in course) for course in COURSES.values()}
    assert len(kinds) > 10


@pytest.mark.parametrize("seed", COURSES)
def test_boxes_fill_the_lane_but_for_an_opening_beside_its_middle(seed: int) -> None:
    for one in COURSES[seed]:
        low, high = one.boxes[:, 1] - one.boxes[:, 4] / 2, one.boxes[:, 1] + one.boxes[:, 4] / 2
        assert (low.min(), high.max()) == pytest.approx((-HALF_WIDTH, HALF_WIDTH))
        blocked = sum((high - low).tolist())
        free = OPENING_WIDTH if one.kind == "gate" else 0.0
        assert blocked == pytest.approx(2 * HALF_WIDTH - free)
        assert ((low < 0.0) & (high > 0.0)).any()  # the middle of the lane, where it walks by itself


@pytest.mark.parametrize(
    ("kind", "before", "early", "late"),
    [
        ("closing door", False, False, True),
        ("opening door", True, True, False),
        ("bar", True, True, True),
        ("gate", True, True, True),
    ],
)
def test_doors_open_and_close_by_the_time_since_the_sensor(
    kind: str, before: bool, early: bool, late: bool
) -> None:
    obstacle = ParkourObstacle(kind, 10.0, np.zeros((1, 6)))  # type: ignore[arg-type]
    soon, end = min(CLOSING_TIME, OPENING_TIME) - 0.1, max(CLOSING_TIME, OPENING_TIME)
    assert [obstacle.is_closed(waited) for waited in (-1.0, soon, end)] == [before, early, late]
