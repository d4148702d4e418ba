"""Moments on a straight road of three lanes, for tests of operators."""

from __future__ import annotations

import numpy as np

from pdtui.paper.driving.key_effects import KeyEffects
from pdtui.paper.driving.road_sight import LANE_WIDTH, RoadSight
from pdtui.paper.driving.route_line import RouteLine

LEFT_LANE, MIDDLE_LANE, RIGHT_LANE = 2, 1, 0
EFFECTS = KeyEffects(
    left=tuple(np.interp(np.arange(41) * 0.1, [0.0, 2.0], [0.0, LANE_WIDTH]).tolist()),
    right=tuple(np.interp(np.arange(41) * 0.1, [0.0, 2.0], [0.0, -LANE_WIDTH]).tolist()),
    settling_time=1.9,
    deceleration=6.0,
    speed=10.0,
    dt=0.1,
    periods={"lane left": 0.8, "lane right": 0.8},
)


STRAIGHT_LINE = RouteLine(np.array([[0.0, 0.0], [500.0, 0.0]]))
"""The middle of a straight road along the x axis."""


def cone(ahead: float, lane: float) -> list[float]:
    """Return something that stands, as many lanes to the left of the car's own."""
    return [ahead, lane * LANE_WIDTH, 0.0, 0.2, 0.2, 0.0, 0.0]


def car(ahead: float, lane: float, speed: float, yaw: float = 0.0) -> list[float]:
    """Return a car that drives, along the road or at an angle to it, as many lanes to the left."""
    return [ahead, lane * LANE_WIDTH, yaw, 2.3, 0.95, speed, 0.0]


def sight(
    *others: list[float],
    lane: int = MIDDLE_LANE,
    speed: float = 10.0,
    heading: float = 0.0,
    aside: float = 0.0,
) -> RoadSight:
    """Return a moment in a lane; `aside` is how far to the left of its middle the car is, m."""
    right = (lane + 0.5) * LANE_WIDTH + aside
    beside = right - 1.5 * LANE_WIDTH
    seen = np.array(others, float).reshape(-1, 7)
    seen[:, 1] += beside
    return RoadSight(STRAIGHT_LINE, 0.0, beside, speed, heading, 0.0, 3 * LANE_WIDTH - right, right, seen)
