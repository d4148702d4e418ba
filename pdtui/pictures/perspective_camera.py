"""A camera that projects points of the world, in m, to dots of a canvas."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats

_DISTANCE = 6.0  # of the camera from the target, in extents
_NEAREST = 0.15  # least distance of a point that is drawn, as a share of the target's


@dataclass(frozen=True)
class PerspectiveCamera:
    """A perspective camera whose picture has world x to the right, or another direction on the ground.

    Attributes:
        target: the point that appears at `center`, m.
        elevation: angle of the camera above the horizon, degrees; 90 looks straight down, with world y up.
        extent: half the size of the area to show, m; the camera is 6 times as far away.
        zoom: dots per m at the target's distance.
        center: place of the target in the picture, in dots.
        azimuth: angle from world x to the picture's right, counterclockwise about the vertical, rad.
    """

    target: tuple[float, float, float]
    elevation: float
    extent: float
    zoom: float
    center: tuple[float, float]
    azimuth: float = 0.0

    def project(self, points: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return dots (..., 2) and magnifications (...) of points (..., 3), and which are in front of it.

        Magnification is relative to the target. Points that do not lie in front must not be drawn.
        """
        relative = self._turned(points)
        up = relative[..., 2] * cos(radians(self.elevation)) + relative[..., 1] * sin(radians(self.elevation))
        depth = 1.0 + self.depth(points) / (_DISTANCE * self.extent)
        before = depth > _NEAREST
        magnification = 1.0 / np.where(before, depth, 1.0)
        dots = np.stack(
            [
                self.center[0] + relative[..., 0] * magnification * self.zoom,
                self.center[1] - up * magnification * self.zoom,
            ],
            axis=-1,
        )
        return dots, magnification, before

    def depth(self, points: Floats) -> Floats:
        """Return how far points (..., 3) lie behind the target along the line of sight, m."""
        relative = self._turned(points)
        elevation = radians(self.elevation)
        away: Floats = relative[..., 1] * cos(elevation) - relative[..., 2] * sin(elevation)
        return away

    def _turned(self, points: Floats) -> Floats:
        """Return points relative to the target, along the picture's right, away from the camera, and up."""
        relative: Floats = points - np.array(self.target)
        if self.azimuth:
            x, y = relative[..., 0], relative[..., 1]
            right = x * cos(self.azimuth) + y * sin(self.azimuth)
            away = y * cos(self.azimuth) - x * sin(self.azimuth)
            relative = np.stack([right, away, relative[..., 2]], axis=-1)
        return relative


def round_length_down(length: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that does not exceed `length`."""
    power = 10.0 ** np.floor(np.log10(length))
    for factor in (5.0, 2.0):
        if factor * power <= length * (1 + 1e-9):
            return float(factor * power)
    return float(power)
