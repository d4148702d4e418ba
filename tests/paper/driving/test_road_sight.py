"""What the operator foresees: where others will be, on the road and across it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pdtui.paper.driving.road_sight import LANE_WIDTH, RoadSight
from pdtui.paper.driving.route_line import RouteLine
from tests.paper.driving.sights import car, cone, sight

RADIUS = 30.0


def _bend() -> RoadSight:
    """At the beginning of a quarter turn to the left."""
    angles = np.linspace(0.0, math.pi / 2, 200)
    return replace(sight(), line=RouteLine(RADIUS * np.stack([np.sin(angles), 1.0 - np.cos(angles)], axis=1)))


def test_who_stands_stays_and_who_drives_along_the_road_follows_it() -> None:
    seen = replace(
        _bend(), others=np.array([cone(10.0, 0), car(0.0, 1, 8.0), car(0.0, -1, 8.0, yaw=math.pi)])
    )
    ahead, beside, *_ = np.moveaxis(seen.foresee(np.array([0.0, 2.0])), -1, 0)
    assert ahead[0, 0] == ahead[0, 1]
    # The one beside it comes 16 m further along its bend and stays in its lane.
    np.testing.assert_allclose(ahead[1], [0.0, 16.0], atol=0.3)
    np.testing.assert_allclose(beside[1], LANE_WIDTH, atol=0.1)
    # One that comes towards it follows the road as well.
    np.testing.assert_allclose(ahead[2], [0.0, -16.0], atol=0.3)
    assert seen.followers.tolist() == [False, True, True]


def test_who_crosses_the_road_keeps_its_speed_and_its_turn() -> None:
    straight = car(20.0, -4, 8.0, yaw=math.pi / 2)
    turning = [*straight[:6], 0.5]
    ahead, beside, along, across = np.moveaxis(sight(straight, turning).foresee(np.array([1.0])), -1, 0)
    assert [ahead[0, 0], beside[0, 0]] == pytest.approx([20.0, 8.0 - 4 * LANE_WIDTH])
    assert [along[0, 0], across[0, 0]] == pytest.approx([0.95, 2.3])
    # An arc of 16 m radius, half a radian long.
    assert ahead[1, 0] == pytest.approx(20.0 - 16.0 * (1.0 - math.cos(0.5)), abs=0.01)
    assert beside[1, 0] == pytest.approx(16.0 * math.sin(0.5) - 4 * LANE_WIDTH, abs=0.01)


def test_the_road_bends_and_the_car_swings() -> None:
    seen = _bend()
    assert seen.bend(10.0) == pytest.approx(1.0 / RADIUS, rel=0.02)
    assert sight().bend(0.0) == 0.0
    follows = replace(seen, along=10.0, yaw_rate=seen.speed / RADIUS)
    assert follows.swing == pytest.approx(0.0, abs=0.01)
    x, y = follows.road_ahead().T
    assert np.hypot(x, y - RADIUS)[:10] == pytest.approx(RADIUS, abs=0.1)
