"""Places along a road."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.paper.driving.route_line import RouteLine

CORNER = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 0.0], [10.0, 20.0]])
"""East, then north, with a point that is there twice."""


def test_places_are_measured_along_the_line_and_to_its_left() -> None:
    line = RouteLine(CORNER)
    assert line.length == 30.0
    places = np.array([[4.0, 2.0], [4.0, -3.0], [8.5, 12.0], [-5.0, 1.0], [9.0, 25.0]])
    expected = [[4.0, 2.0, 0.0], [4.0, -3.0, 0.0], [22.0, 1.5, math.pi / 2], [-5.0, 1.0, 0.0]]
    found = line.locate(places)
    np.testing.assert_allclose(found[:4], expected, atol=1e-12)
    # Beyond its end, the line goes on straight.
    np.testing.assert_allclose(found[4], [35.0, 1.0, math.pi / 2], atol=1e-12)


def test_points_of_the_line_are_found_again() -> None:
    line = RouteLine(CORNER)
    along = np.array([-2.0, 0.0, 9.0, 10.5, 30.0, 33.0])
    points = line.points_at(along)
    np.testing.assert_allclose(points[[0, 3, 5]], [[-2.0, 0.0], [10.0, 0.5], [10.0, 23.0]], atol=1e-12)
    np.testing.assert_allclose(line.locate(points)[:, 0], along, atol=1e-9)
    np.testing.assert_allclose(line.locate(points)[:, 1], 0.0, atol=1e-9)


def test_a_route_that_crosses_itself_is_told_apart_by_where_the_car_was() -> None:
    around = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [10.0, 10.0], [10.0, -10.0]])
    line = RouteLine(around)
    crossing = np.array([[10.0, 0.2]])
    assert line.locate(crossing, 0.0, 15.0)[0].tolist() == pytest.approx([10.0, 0.2, 0.0])
    later = line.locate(crossing, 42.0, 60.0)[0]
    assert later.tolist() == pytest.approx([49.8, 0.0, -math.pi / 2])


def test_points_that_differ_by_rounding_give_the_line_no_direction_of_their_own() -> None:
    joined = np.array([[0.0, 0.0], [10.0, 0.0], [10.0 - 1e-7, 1e-7], [20.0, 0.0]])
    assert RouteLine(joined).locate(np.array([[10.0, 1.0]]))[0].tolist() == pytest.approx(
        [10.0, 1.0, 0.0], abs=1e-6
    )


def test_a_point_is_no_line() -> None:
    with pytest.raises(RobotError, match="at least two different points, found 3"):
        RouteLine(np.ones((3, 2)))
