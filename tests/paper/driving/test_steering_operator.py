"""The operator that steers: on a simple car it keeps to its lane, passes what stands, and hands back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pdtui.paper.driving.road_sight import CAR_HALF_LENGTH, CAR_HALF_WIDTH, LANE_WIDTH, RoadSight
from pdtui.paper.driving.route_line import RouteLine
from pdtui.paper.driving.steering_operator import ManualControlValues, SteeringOperator
from tests.paper.driving.sights import LEFT_LANE, MIDDLE_LANE, STRAIGHT_LINE, cone, sight

DT, WHEELBASE, FULL_LOCK = 0.1, 2.47, math.radians(40.0)


class StraightRoad:
    """A car with two axles on a straight road of three lanes, among things that stand."""

    def __init__(self, *things: tuple[float, float], beside: float = 0.0, speed: float = 10.0) -> None:
        self.things = np.array(things, float).reshape(-1, 2)
        self.along, self.beside, self.heading, self.speed = 0.0, beside, 0.0, speed

    def look(self) -> RoadSight:
        """What there is to see; the middle lane's middle is at 0."""
        others = [
            [x, y, 0.0, 0.3, 0.3, 0.0, 0.0] for x, y in self.things.tolist() if abs(x - self.along) < 50.0
        ]
        half = 1.5 * LANE_WIDTH
        return RoadSight(
            STRAIGHT_LINE,
            self.along,
            self.beside,
            self.speed,
            self.heading,
            0.0,
            half - self.beside,
            half + self.beside,
            np.array(others).reshape(-1, 7),
        )

    def step(self, controls: ManualControlValues) -> None:
        self.speed = max(0.0, self.speed + 5.0 * controls.throttle * DT)
        self.heading += self.speed * math.tan(FULL_LOCK * controls.steering) / WHEELBASE * DT
        self.along += self.speed * math.cos(self.heading) * DT
        self.beside += self.speed * math.sin(self.heading) * DT

    @property
    def touches(self) -> bool:
        x, y = np.abs(self.things - (self.along, self.beside)).T
        return bool(((x < CAR_HALF_LENGTH + 0.3) & (y < CAR_HALF_WIDTH + 0.3)).any())


def test_it_keeps_to_the_middle_of_its_lane() -> None:
    road, operator = StraightRoad(beside=1.2), SteeringOperator(DT, always=True)
    for _ in range(100):
        controls = operator.choose_controls(road.look())
        assert controls is not None
        road.step(controls)
    assert road.along > 80.0
    assert abs(road.beside) < 0.3
    assert abs(road.heading) < 0.03


def test_it_passes_what_stands_in_its_lane() -> None:
    road, operator = StraightRoad((60.0, 0.0), (62.0, LANE_WIDTH)), SteeringOperator(DT, always=True)
    for _ in range(120):
        road.step(operator.choose_controls(road.look()) or ManualControlValues(0.0, 0.0))
        assert not road.touches
        assert abs(road.beside) < 1.5 * LANE_WIDTH - 0.9
    assert road.along > 75.0
    assert road.beside < -2.0


def test_it_stops_before_what_blocks_the_whole_road() -> None:
    wall = [(70.0, y) for y in np.arange(-5.0, 5.1, 1.0)]
    road, operator = StraightRoad(*wall), SteeringOperator(DT, always=True)
    for _ in range(200):
        road.step(operator.choose_controls(road.look()) or ManualControlValues(0.0, 0.0))
        assert not road.touches
    assert road.speed < 0.5


@pytest.mark.parametrize("things", [[(7.0, 0.0)], [(7.0, 0.0), (7.0, 2.5)], [(7.0, -0.5), (7.5, -4.0)]])
def test_it_drives_a_halted_car_round_what_stands_close_ahead(things: list[tuple[float, float]]) -> None:
    road, operator = StraightRoad(*things, speed=0.0), SteeringOperator(DT)
    for _ in range(200):
        road.step(operator.choose_controls(road.look()) or ManualControlValues(0.0, -1.0))
        assert not road.touches
        assert abs(road.beside) < 1.5 * LANE_WIDTH - CAR_HALF_WIDTH
    assert road.along > 12.0


def test_it_takes_over_only_where_it_must_and_hands_back_afterwards() -> None:
    """Left alone, this car keeps its lane and its speed."""
    road, operator = StraightRoad((80.0, 0.0)), SteeringOperator(DT)
    taken = []
    for step in range(150):
        controls = operator.choose_controls(road.look())
        if controls is not None:
            taken.append(step)
        road.step(controls or ManualControlValues(-0.5 * road.heading / FULL_LOCK, 0.0))
        assert not road.touches
    assert road.along > 110.0
    assert 30 < taken[0] < 60
    assert taken == list(range(taken[0], taken[-1] + 1))
    assert len(taken) < 70


def test_it_sees_late() -> None:
    operator = SteeringOperator(DT)
    seen = [sight()] * 10 + [sight(cone(20.0, 0), lane=MIDDLE_LANE)] * 8
    acts = [operator.choose_controls(one) is not None for one in seen]
    assert acts.index(True) == 10 + 3


@pytest.mark.parametrize("lane", [LEFT_LANE, MIDDLE_LANE])
def test_it_slows_down_for_a_bend(lane: int) -> None:
    straight = sight(lane=lane, speed=12.0)
    angles = np.linspace(0.0, 5.0, 40)
    line = RouteLine(12.0 * np.stack([np.sin(angles), 1.0 - np.cos(angles)], axis=1))
    bend = replace(straight, line=line)
    controls = []
    for seen in (straight, bend):
        operator = SteeringOperator(DT, always=True)
        controls.append([operator.choose_controls(seen) for _ in range(4)][-1])
    assert controls[0] is not None
    assert controls[1] is not None
    assert controls[1].throttle < controls[0].throttle
    assert controls[1].steering > controls[0].steering + 0.1
