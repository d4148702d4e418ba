"""The camera that follows the robot: world points in m to dots of a canvas."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_DISTANCE = 6.0
_NEAREST = 0.15


@dataclass(frozen=True)
class PerspectiveCamera:
    """A perspective camera whose picture has world x to the right.

    Attributes:
        target: the point in the middle of the picture, m.
        elevation: how far above the horizon the camera stands, degrees: 90 looks straight
            down, with world y up.
        extent: half the size of what must be seen, m; the camera stands 6 times as far away.
        zoom: dots per m at the target.
        centre: where the target appears, in dots.
    """

    target: tuple[float, float, float]
    elevation: float
    extent: float
    zoom: float
    centre: tuple[float, float]

    def project(self, points: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Dots (..., 2) of points (..., 3), magnification (...) against the target, and which lie in front.

        Those that do not lie in front of the camera are to be left out.
        """
        relative = points - np.array(self.target)
        s, c = sin(radians(self.elevation)), cos(radians(self.elevation))
        up = relative[..., 2] * c + relative[..., 1] * s
        away = relative[..., 1] * c - relative[..., 2] * s
        distance = _DISTANCE * self.extent
        depth = 1.0 + away / distance
        before = depth > _NEAREST
        magnification = 1.0 / np.where(before, depth, 1.0)
        dots = np.stack(
            [
                self.centre[0] + relative[..., 0] * magnification * self.zoom,
                self.centre[1] - up * magnification * self.zoom,
            ],
            axis=-1,
        )
        return dots, magnification, before

    def depth(self, points: Floats) -> Floats:
        """Distance of points (..., 3) from the target along the line of sight, m; the nearest is least."""
        relative = points - np.array(self.target)
        s, c = sin(radians(self.elevation)), cos(radians(self.elevation))
        away: Floats = relative[..., 1] * c - relative[..., 2] * s
        return away


def round_length_down(length: float) -> float:
    """The largest of 1, 2 or 5 times a power of ten that is not longer."""
    power = 10.0 ** np.floor(np.log10(length))
    for factor in (5.0, 2.0):
        if factor * power <= length * (1 + 1e-9):
            return float(factor * power)
    return float(power)
