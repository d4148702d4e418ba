"""Scenery and traffic: how lines are painted, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.core.scenery import NO_TRAFFIC, RoadLine, Scenery, Traffic

CORNER = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 12.0]])


def test_a_broken_line_is_painted_in_dashes_around_corners() -> None:
    dashes = RoadLine("broken lane line", CORNER).painted_pieces()
    assert [dash[:, :2].tolist() for dash in dashes] == [
        [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]],
        [[2.0, 6.0], [2.0, 9.0]],
    ]


def test_other_lines_are_painted_whole() -> None:
    line = RoadLine("route", np.column_stack([CORNER, [0.0, 1.0, 2.0]]))
    (piece,) = line.painted_pieces()
    np.testing.assert_array_equal(piece, line.points)


@pytest.mark.parametrize("kind", ["route", "broken lane line"])
def test_a_point_is_no_line(kind: str) -> None:
    assert RoadLine("route" if kind == "route" else "broken lane line", CORNER[:1]).painted_pieces() == []


def test_what_has_the_wrong_shape_is_refused_by_name() -> None:
    with pytest.raises(RobotError, match=r"road edge: expected points of shape .* found \(4,\)"):
        RoadLine("road edge", np.zeros(4))
    with pytest.raises(RobotError, match="route: expected finite points"):
        RoadLine("route", CORNER * np.nan)
    with pytest.raises(RobotError, match=r"scenery: cylinders: expected shape \(2, 3\), found \(2, 2\)"):
        Scenery(cylinders=np.zeros((2, 2)))
    with pytest.raises(RobotError, match=r"traffic: poses: expected shape \(1, 4\), found \(0, 4\)"):
        Traffic(np.zeros(1, np.int64), ("vehicle",))
    with pytest.raises(RobotError, match="expected 0 kinds, one per box, found 1"):
        Traffic(kinds=("vehicle",))


def test_two_boxes_of_a_kind_need_two_numbers() -> None:
    two = np.zeros(2, np.int64), np.zeros((2, 4)), np.ones((2, 3))
    with pytest.raises(RobotError, match="a number of its own for each box"):
        Traffic(two[0], ("vehicle", "vehicle"), *two[1:])
    assert Traffic(two[0], ("vehicle", "obstacle"), *two[1:]).keys == [("vehicle", 0), ("obstacle", 0)]
    assert NO_TRAFFIC.keys == []
