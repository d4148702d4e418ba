"""The points of paths from above: whole, thinned where they are long, and of the latest steps."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats

MOST_POINTS = 5000
_JUMP = 1.0  # longest step that is drawn as a line, m
_FARTHEST = 1e9  # coordinates beyond it, in m, come from a simulation that diverges and are not drawn

PathPart = Literal["present", "past", "recent"]


class PathTrail:
    """The points of the present path and of the one before it.

    When a path outgrows `MOST_POINTS`, every second point is dropped, and from then on only every second,
    fourth, … new point is kept, so that the shape remains however long the drive. All of the latest points
    are kept beside.
    """

    def __init__(self) -> None:
        self.points: Floats = np.empty((0, 3))
        self.past: Floats = np.empty((0, 3))
        self.recent: Floats = np.empty((0, 3))
        self._stride = 1
        self._skip = 0

    def extend(self, path: Floats, *, restarted: bool) -> None:
        """Append rows (x, y, behavior), shape (n, 3), after starting a new path if `restarted`."""
        if restarted and len(self.points):
            self.past, self.points, self.recent = self.points, np.empty((0, 3)), np.empty((0, 3))
            self._stride, self._skip = 1, 0
        path = path[are_within_view(path)]
        self.recent = np.concatenate([self.recent, path])[-MOST_POINTS:]
        kept = path[self._skip :: self._stride]
        self._skip = (self._skip - len(path)) % self._stride
        self.points = np.concatenate([self.points, kept])
        while len(self.points) > MOST_POINTS:
            # Whether the last point has an odd or an even index, the next points keep the new stride.
            self._skip += self._stride * (len(self.points) % 2)
            self._stride *= 2
            self.points = self.points[::2]

    def line_segments(
        self, part: PathPart = "present", steps: int = MOST_POINTS
    ) -> tuple[Floats, Floats, NDArray[np.int16]]:
        """Return starts (n, 2), ends (n, 2) and behaviors (n,) of a path's lines, without jumps.

        Args:
            part: the whole present path, the one before it, or the latest `steps` of the present one.
            steps: control steps.
        """
        points = {"present": self.points, "past": self.past, "recent": self.recent[-steps - 1 :]}[part]
        starts, ends = points[:-1], points[1:]
        longest = _JUMP * (1 if part == "recent" else self._stride)
        joined = np.hypot(*(ends[:, :2] - starts[:, :2]).T) <= longest
        return starts[joined, :2], ends[joined, :2], ends[joined, 2].astype(np.int16)


def are_within_view(places: Floats) -> NDArray[np.bool_]:
    """Return which places (..., n) are finite and near enough to be drawn, shape (...)."""
    near: NDArray[np.bool_] = np.asarray((np.abs(places) < _FARTHEST).all(axis=-1))
    return near
