"""Getting off a tree: notices that the robot walks against one, and turns it until the tree is aside.

A robot that cannot feel trees walks on against the one before it, and a prediction that knows no contact
promises that it comes past. What gets it off is turning, on the spot if need be; not each way works from
each place, so that after a while without success the other way is tried.
"""

from __future__ import annotations

import math

import numpy as np

from pdtui.core.angles import wrap_angle
from pdtui.core.attributes import Floats

WATCHED = 0.5
"""So long it has to have come nowhere, s."""
_NOWHERE = 0.12
_NEAR = 0.45
_AHEAD = 1.2
_CLEAR_TURNED = 1.3
_PATIENCE = 1.6


class TreeContactRecovery:
    """Says which way to turn while the robot is held by a tree.

    Args:
        trees: x, y and radius, m, shape (N, 3).
        dt: s per control step.
    """

    def __init__(self, trees: Floats, dt: float) -> None:
        self._trees, self._dt = trees, dt
        self._watched = round(WATCHED / dt)
        self._side, self._since = 0, 0.0

    def turn(self, seen: Floats, heading: float, halted: bool) -> int:
        """Which way to turn now: 1 left, −1 right, 0 where nothing holds the robot.

        Args:
            seen: x, y and heading of the places seen so far, shape (S, 3).
            heading: where it heads by now, rad.
            halted: whether what was latched lately made it stand.
        """
        x, y, saw = seen[-1].tolist()
        time = len(seen) * self._dt
        away = np.hypot(self._trees[:, 0] - x, self._trees[:, 1] - y) - self._trees[:, 2]
        nearest = int(np.argmin(away)) if len(away) else -1
        if nearest < 0 or away[nearest] > _NEAR:
            self._side = 0
            return 0
        to_tree = math.atan2(self._trees[nearest, 1] - y, self._trees[nearest, 0] - x)
        if self._side:
            if abs(wrap_angle(to_tree - heading)) > _CLEAR_TURNED:
                self._side = 0
            elif time - self._since > _PATIENCE:
                self._side, self._since = -self._side, time
            return self._side
        moved = np.hypot(*(seen[-1, :2] - seen[max(0, len(seen) - 1 - self._watched), :2]))
        before = abs(wrap_angle(to_tree - saw)) < _AHEAD
        if halted or len(seen) <= self._watched or moved > _NOWHERE or not before:
            return 0
        self._side, self._since = self._better(to_tree, heading), time
        return self._side

    @staticmethod
    def _better(to_tree: float, heading: float) -> int:
        """The way by which it is past the tree sooner, and afterwards heads less far from +x."""
        left, right = wrap_angle(to_tree + _CLEAR_TURNED), wrap_angle(to_tree - _CLEAR_TURNED)
        costs = [abs(wrap_angle(aim - heading)) + abs(aim) for aim in (left, right)]
        return 1 if costs[0] <= costs[1] else -1
