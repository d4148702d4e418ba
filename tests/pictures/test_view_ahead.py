"""The picture from above: whatever its shape, it shows the ground ahead that the operator may see."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdtui.pictures.view_ahead import AHEAD, ASIDE, ViewAhead


def _root(yaw: float) -> np.ndarray:
    return np.array([3.0, 1.0, 0.3, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)])


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0, math.pi])
@pytest.mark.parametrize("shape", [(16, 8), (84, 36), (300, 60), (40, 90)])
def test_every_picture_contains_the_least_area(yaw: float, shape: tuple[int, int]) -> None:
    view, place = ViewAhead(), np.array([3.0, 1.0])
    view.follow(_root(yaw))
    least, shown = view.frame(place, 0.4, AHEAD, ASIDE), view.frame(place, 0.4, *shape)
    np.testing.assert_allclose(least.size, [6.4, 3.2])
    assert (np.abs(shown.middle - least.middle) <= (shown.size - least.size) / 2 + 1e-9).all()
    ahead = np.array([math.cos(yaw), math.sin(yaw)])
    assert (least.middle - place) @ ahead > 0.0


def test_the_picture_follows_a_turn_slowly_and_a_restart_at_once() -> None:
    view, place = ViewAhead(), np.zeros(2)
    view.follow(_root(0.0))
    view.follow(_root(math.pi))
    assert view.frame(place, 0.4, AHEAD, ASIDE).middle[0] > 0.0
    for _ in range(40):
        view.follow(_root(math.pi))
    assert view.frame(place, 0.4, AHEAD, ASIDE).middle[0] < 0.0
    view.follow(_root(0.0), restarted=True)
    assert view.frame(place, 0.4, AHEAD, ASIDE).middle[0] > 1.0
