"""Recovery from contact with a tree: turns a stuck robot until the tree is beside it.

A robot that cannot sense trees keeps walking against one, and a prediction without contacts expects it to
pass. Turning frees it, on the spot if need be. Some directions do not work in some places, so that after a
while the other direction is tried.
"""

from __future__ import annotations

import math

import numpy as np

from pdtui.core.attributes import Floats, wrap_angle

STUCK_TIME = 0.5
"""Time without progress after which the robot counts as stuck, s."""
_NO_PROGRESS = 0.12
"""Farthest that a stuck robot moves in that time, m."""
_NEAR = 0.45
"""Farthest distance from the tree's surface at which it may hold the robot, m."""
_AHEAD = 1.2
"""Largest angle between the heading and a tree that is ahead, rad."""
_CLEAR_TURNED = 1.3
"""Angle between the heading and the tree from which the robot is free, rad."""
_PATIENCE = 1.6
"""Time after which the other direction is tried, s."""


class TreeContactRecovery:
    """Decides which way to turn while the robot is stuck at a tree.

    Args:
        trees: x, y and radius of the trees, m, shape (N, 3).
        dt: duration of a control step, s.
    """

    def __init__(self, trees: Floats, dt: float) -> None:
        self._trees, self._dt = trees, dt
        self._watched = round(STUCK_TIME / dt)
        self._side, self._since = 0, 0.0

    def choose_turn(self, seen: Floats, heading: float, halted: bool) -> int:
        """Return which way to turn now: 1 left, −1 right, 0 if the robot is not stuck.

        Args:
            seen: x, y and heading of the places seen so far, shape (S, 3).
            heading: predicted heading now, rad.
            halted: whether a key latched lately made it stand still.
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
        if halted or len(seen) <= self._watched or moved > _NO_PROGRESS or not before:
            return 0
        self._side, self._since = self._better_direction(to_tree, heading), time
        return self._side

    @staticmethod
    def _better_direction(to_tree: float, heading: float) -> int:
        """Return the direction that clears the tree sooner and leaves the heading nearer to +x."""
        left, right = wrap_angle(to_tree + _CLEAR_TURNED), wrap_angle(to_tree - _CLEAR_TURNED)
        costs = [abs(wrap_angle(aim - heading)) + abs(aim) for aim in (left, right)]
        return 1 if costs[0] <= costs[1] else -1
