"""The path that the robot has taken, in bounded memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_POINTS = 5000
_JUMP = 1.0


class PathTrail:
    """The points of the present path and of the one before it.

    When a path outgrows `MOST_POINTS`, every second point is dropped, and from then on only every second,
    fourth, … new point is kept, so that the shape remains however long the drive.
    """

    def __init__(self) -> None:
        self.points: Floats = np.empty((0, 3))
        self.past: Floats = np.empty((0, 3))
        self._stride = 1
        self._skip = 0

    def extend(self, path: Floats, *, restarted: bool) -> None:
        """Append rows (x, y, behavior), shape (n, 3), after starting a new path if `restarted`."""
        if restarted and len(self.points):
            self.past, self.points = self.points, np.empty((0, 3))
            self._stride, self._skip = 1, 0
        path = path[np.isfinite(path).all(axis=1)]
        kept = path[self._skip :: self._stride]
        self._skip = (self._skip - len(path)) % self._stride
        self.points = np.concatenate([self.points, kept])
        while len(self.points) > MOST_POINTS:
            # Whether the last point has an odd or an even index, the next points keep the new stride.
            self._skip += self._stride * (len(self.points) % 2)
            self._stride *= 2
            self.points = self.points[::2]

    def line_segments(self, past: bool = False) -> tuple[Floats, Floats, NDArray[np.int16]]:
        """Return starts (n, 2), ends (n, 2) and behaviors (n,) of the path's lines, without jumps."""
        points = self.past if past else self.points
        starts, ends = points[:-1], points[1:]
        joined = np.hypot(*(ends[:, :2] - starts[:, :2]).T) <= _JUMP * self._stride
        return starts[joined, :2], ends[joined, :2], ends[joined, 2].astype(np.int16)
