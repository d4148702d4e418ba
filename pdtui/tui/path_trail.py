"""Where the robot has been: a bounded memory of its path."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_POINTS = 5000
_JUMP = 1.0


class PathTrail:
    """Points of the present path, and those of the one before it.

    When a path outgrows `MOST_POINTS`, every second point goes, and from then on only every second, fourth, …
    new one is kept: the shape stays, however long the drive.
    """

    def __init__(self) -> None:
        self.points: Floats = np.empty((0, 3))
        self.past: Floats = np.empty((0, 3))
        self._stride = 1
        self._skip = 0

    def extend(self, path: Floats, *, restarted: bool) -> None:
        """Append rows (x, y, behavior), shape (n, 3); `restarted` ends the old path first."""
        if restarted and len(self.points):
            self.past, self.points = self.points, np.empty((0, 3))
            self._stride, self._skip = 1, 0
        path = path[np.isfinite(path).all(axis=1)]
        kept = path[self._skip :: self._stride]
        self._skip = (self._skip - len(path)) % self._stride
        self.points = np.concatenate([self.points, kept])
        while len(self.points) > MOST_POINTS:
            # The last point is at an odd index or an even one; what follows it keeps the new stride.
            self._skip += self._stride * (len(self.points) % 2)
            self._stride *= 2
            self.points = self.points[::2]

    def line_segments(self, past: bool = False) -> tuple[Floats, Floats, NDArray[np.int16]]:
        """Lines of the path: starts (n, 2), ends (n, 2) and the behavior at each end (n,); jumps left out."""
        points = self.past if past else self.points
        starts, ends = points[:-1], points[1:]
        joined = np.hypot(*(ends[:, :2] - starts[:, :2]).T) <= _JUMP * self._stride
        return starts[joined, :2], ends[joined, :2], ends[joined, 2].astype(np.int16)
