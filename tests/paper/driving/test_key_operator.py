"""The operator with keys: what it does about what it sees, how late, and how often."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from pdtui.paper.driving.key_operator import PRESSES_PER_SECOND, KeyOperator
from pdtui.paper.driving.operator_memory import REACTION_TIME, sample_judgment_errors
from pdtui.paper.driving.road_sight import RoadSight
from pdtui.paper.driving.route_line import RouteLine
from tests.paper.driving.sights import EFFECTS, LEFT_LANE, MIDDLE_LANE, RIGHT_LANE, car, cone, sight

DELAY = 3
"""Control steps of 0.1 s."""


def _keys(sights: Iterable[RoadSight]) -> list[str]:
    operator = KeyOperator(EFFECTS, 0.1)
    return [operator.choose_key(one) for one in sights]


def _first_key(seen: RoadSight) -> str:
    """The first key that it presses where everything stays as it is for 4 steps."""
    return next(filter(None, _keys([seen] * (DELAY + 1))), "")


def test_on_a_free_road_it_leaves_the_policy_alone() -> None:
    assert not any(_keys([sight()] * 50))
    beside = sight(cone(20.0, 1), cone(25.0, -1), car(10.0, 1, 8.0), car(-10.0, 0, 14.0))
    assert not any(_keys([beside] * 10))


@pytest.mark.parametrize(
    ("others", "lane", "key"),
    [
        ([cone(25.0, 0)], LEFT_LANE, "lane right"),
        ([cone(25.0, 0)], RIGHT_LANE, "lane left"),
        ([cone(25.0, 0), cone(28.0, 1)], MIDDLE_LANE, "lane right"),
        ([cone(25.0, 0), car(2.0, -1, 10.0)], MIDDLE_LANE, "lane left"),
        # One comes up from behind in the lane to the left.
        ([cone(25.0, 0), car(-12.0, 1, 17.0)], MIDDLE_LANE, "lane right"),
    ],
)
def test_it_changes_to_the_lane_that_is_free(others: list[list[float]], lane: int, key: str) -> None:
    assert _first_key(sight(*others, lane=lane)) == key


def test_it_brakes_where_both_lanes_are_blocked_and_only_when_it_must() -> None:
    def blocked(gap: float) -> RoadSight:
        return sight(cone(gap, 0), car(3.0, 1, 10.0), car(3.0, -1, 10.0))

    assert _first_key(blocked(40.0)) == ""
    assert _first_key(blocked(24.0)) == "brake"


def test_it_brakes_for_a_car_that_stops_and_not_for_one_that_keeps_its_distance() -> None:
    def follow(speed: float) -> RoadSight:
        return sight(car(15.0, 0, speed), car(0.0, 1, 10.0), car(0.0, -1, 10.0))

    assert _first_key(follow(9.5)) == ""
    assert _first_key(follow(2.0)) == "brake"


def test_it_steers_away_from_the_edge_to_which_the_car_drifts() -> None:
    assert _first_key(sight(lane=LEFT_LANE, heading=0.25, aside=0.5)) == "lane right"
    assert _first_key(sight(lane=RIGHT_LANE, heading=-0.25, aside=-0.5)) == "lane left"


def test_it_sees_late() -> None:
    assert pytest.approx(DELAY * 0.1) == REACTION_TIME
    keys = _keys([sight()] * 20 + [sight(cone(20.0, 0), lane=RIGHT_LANE)] * 10)
    assert [step for step, key in enumerate(keys) if key][:1] == [20 + DELAY]


def test_it_does_not_press_more_often_than_a_hand_can() -> None:
    """What it sees changes at once, so that it has reason to brake and to release in every step."""
    blocked = sight(cone(20.0, 0), car(3.0, 1, 10.0), car(3.0, -1, 10.0))
    keys = _keys([blocked, sight(speed=5.0)] * 150)
    pressed = [step for step, key in enumerate(keys) if key]
    assert len(pressed) > 60
    assert min(np.diff(pressed)) < 3
    for first, later in zip(pressed, pressed[PRESSES_PER_SECOND:], strict=False):
        assert later - first >= 10


def test_it_releases_the_brake_when_the_road_is_free() -> None:
    blocked = sight(cone(24.0, 0), car(3.0, 1, 10.0), car(3.0, -1, 10.0))
    stopped = sight(cone(16.0, 0), car(3.0, 1, 0.5), car(3.0, -1, 0.5), speed=0.0)
    keys = _keys([blocked] * 4 + [stopped] * 6 + [sight(speed=0.0)] * 5)
    assert [key for key in keys if key] == ["brake", "default"]
    assert keys.index("default") == 10 + DELAY


def test_it_gets_a_car_going_that_stands_before_nothing_and_aside_before_something() -> None:
    assert _keys([sight(speed=0.0)] * 26).count("accelerate") == 1
    near = [key for key in _keys([sight(cone(4.5, 0), speed=0.0, lane=RIGHT_LANE)] * 60) if key]
    assert near[0] == "lane left"


def test_no_two_operators_judge_alike_and_each_is_drawn_again() -> None:
    drawn = [sample_judgment_errors(repeat, scene) for repeat in range(5) for scene in range(20)]
    assert drawn == [sample_judgment_errors(repeat, scene) for repeat in range(5) for scene in range(20)]
    distances = np.array([one.distance for one in drawn])
    assert len({(one.distance, one.speed, one.patience) for one in drawn}) == 100
    assert abs(distances.mean() - 1.0) < 0.02
    assert 0.03 < distances.std() < 0.07


def test_it_stops_in_time_for_a_car_that_crosses_the_road_and_goes_on_when_it_has_passed() -> None:
    def crossing(aside: float, speed: float, ahead: float = 16.0) -> RoadSight:
        return sight(car(ahead, aside, 8.0, yaw=np.pi / 2), speed=speed)

    assert _first_key(crossing(-4.0, 8.0)) == "brake"
    assert _first_key(crossing(4.0, 8.0)) == ""
    keys = _keys([crossing(-4.0, 8.0)] * 4 + [crossing(-3.0, 0.0, 8.0)] * 10 + [crossing(4.0, 0.0, 8.0)] * 6)
    assert [key for key in keys if key] == ["brake", "default"]
    assert keys.index("default") == 14 + DELAY


def test_it_leads_the_car_back_from_an_edge_and_lets_go_once_it_has_turned() -> None:
    slipping = sight(lane=LEFT_LANE, aside=1.4, heading=0.05)
    turned = sight(lane=LEFT_LANE, aside=1.4, heading=-0.2)
    keys = _keys([slipping] * 5 + [turned] * 6)
    assert [key for key in keys if key] == ["lane right", "default"]
    assert keys.index("default") == 5 + DELAY


def test_it_ends_a_lane_change_that_turns_the_car_too_far() -> None:
    before = sight(cone(30.0, 0), lane=RIGHT_LANE)
    askew = sight(cone(25.0, 0), lane=RIGHT_LANE, heading=0.5, aside=0.5)
    keys = [key for key in _keys([before] * 4 + [askew] * 5) if key]
    assert keys == ["lane left", "default"]


def test_it_brakes_before_a_bend_that_is_too_sharp() -> None:
    angles = np.linspace(0.0, 3.0, 60)
    bend = RouteLine(9.0 * np.stack([np.sin(angles), 1.0 - np.cos(angles)], axis=1))
    assert _first_key(replace(sight(speed=5.0), line=bend)) == ""
    assert _first_key(replace(sight(speed=9.0), line=bend)) == "brake"
