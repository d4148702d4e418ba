"""Places along a road: how far along its middle line, and how far to the left of it."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError

_LEAST_LENGTH = 0.01
"""Distance of two points, m, that counts as none."""


class RouteLine:
    """The middle line of the roads that a car is to take.

    Args:
        points: x and y of the line in m, in order along it, shape (N, 2), N > 1.

    Raises:
        RobotError: The line has fewer than two different points.
    """

    def __init__(self, points: Floats) -> None:
        steps = np.diff(points, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        # Where two roads meet, their points may differ by nothing but rounding, in any direction.
        kept = lengths > _LEAST_LENGTH
        if not kept.any():
            raise RobotError(f"route: expected at least two different points, found {len(points)}")
        self._starts, self._lengths = points[:-1][kept], lengths[kept]
        self._directions = steps[kept] / self._lengths[:, None]
        self._alongs = np.concatenate([[0.0], np.cumsum(self._lengths)])

    @property
    def length(self) -> float:
        """Length of the line, m."""
        return float(self._alongs[-1])

    def locate(self, places: Floats, low: float = -np.inf, high: float = np.inf) -> Floats:
        """Return the nearest place on the line for each place.

        Before its first and after its last point, the line goes on straight.

        Args:
            places: x and y in m, shape (K, 2).
            low, high: Part of the line to look at, m along it; a route may cross itself.

        Returns:
            Distance along the line and to its left, m, and direction of the line there, rad, shape (K, 3).
        """
        first = max(0, int(np.searchsorted(self._alongs, low, "right")) - 1)
        last = min(len(self._lengths), int(np.searchsorted(self._alongs, high, "left")) + 1)
        part = slice(min(first, len(self._lengths) - 1), max(last, first + 1))
        starts, directions, lengths = self._starts[part], self._directions[part], self._lengths[part]
        apart = places[:, None] - starts
        inside = (apart * directions).sum(axis=-1)
        ends = np.zeros(len(lengths)), lengths.copy()
        ends[0][0], ends[1][-1] = -np.inf, np.inf
        along = np.clip(inside, *ends)
        off = apart - along[..., None] * directions
        nearest = np.argmin((off**2).sum(axis=-1), axis=1)
        rows = np.arange(len(places))
        x, y = directions[nearest].T
        beside = x * off[rows, nearest, 1] - y * off[rows, nearest, 0]
        return np.stack(
            [self._alongs[part.start + nearest] + along[rows, nearest], beside, np.arctan2(y, x)], axis=1
        )

    def points_at(self, along: Floats) -> Floats:
        """Return the places at distances along the line, shape (K, 2); beyond an end, it goes on straight."""
        pieces = np.clip(np.searchsorted(self._alongs, along, "right") - 1, 0, len(self._lengths) - 1)
        return np.asarray(
            self._starts[pieces] + (along - self._alongs[pieces])[:, None] * self._directions[pieces]
        )
