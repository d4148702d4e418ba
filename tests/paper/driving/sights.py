"""Moments on a straight road of three lanes, for tests of operators."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.paper.driving.key_effects import KeyEffects
from pdtui.paper.driving.road_sight import LANE_WIDTH, ROAD_STEP, RoadSight

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


def cone(ahead: float, lane: float) -> list[float]:
    """Return something that stands, as many lanes to the left of the car's own."""
    return [ahead, lane * LANE_WIDTH, 0.2, 0.2, 0.0, 0.0]


def car(ahead: float, lane: float, speed: float) -> list[float]:
    """Return a car that drives along the road, as many lanes to the left of the car's own."""
    return [ahead, lane * LANE_WIDTH, 2.3, 0.95, speed, 0.0]


def sight(
    *others: list[float],
    lane: int = MIDDLE_LANE,
    speed: float = 10.0,
    heading: float = 0.0,
    aside: float = 0.0,
) -> RoadSight:
    """Return a moment in a lane; `aside` is how far to the left of its middle the car is, m."""
    right = (lane + 0.5) * LANE_WIDTH + aside
    road: Floats = np.stack([np.arange(0.0, 50.0, ROAD_STEP), np.zeros(25)], axis=1)
    road[:, 1] += 1.5 * LANE_WIDTH - right
    return RoadSight(
        speed, heading, 0.0, 3 * LANE_WIDTH - right, right, np.array(others, float).reshape(-1, 6), road
    )
