"""What the picture from above shows of the ground where there are obstacles or roads: mostly what lies ahead.

The screen draws by it, and a program that operates the keys in a person's place sees no more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.robots.geometry import rotate_vectors

AHEAD, ASIDE = 16.0, 8.0
"""Least length along x and width along y of the area shown, in extents of the robot."""
_FORWARD = 0.27
"""Distance from the robot to the middle of the picture, as a share of the picture's size."""
_EASING = 0.12
"""Share of a turn that the picture follows per frame, so that a swaying gait does not shake it."""

ROAD_SPAN = 60.0
"""Length of road that is shown, m: along the heading in large pictures, else along the longer side."""
_ROAD_ZOOM = 1.2
"""Dots per m above which a picture shows that length along the heading; a lane is then 4 dots wide."""
_ROAD_ROBOT = 0.76
"""Place of the robot on a road, as a share of the picture's height from its top."""


class GroundArea(NamedTuple):
    """A rectangle of ground: its middle and its size along x and y, m, and the picture's dots per m."""

    middle: Floats
    size: Floats
    zoom: float


class ViewAhead:
    """Frames the ground ahead of a robot that turns."""

    _ahead: Floats | None = None

    def follow(self, root: Floats, *, restarted: bool = False) -> None:
        """Follow the root's heading by one frame; show it at once at the start of an episode."""
        ahead = heading_on_ground(root)
        if self._ahead is None or restarted:
            self._ahead = ahead
        self._ahead = self._ahead + _EASING * (ahead - self._ahead)

    def frame(self, place: Floats, extent: float, width: float, height: float) -> GroundArea:
        """Return the area that a picture shows: `AHEAD` by `ASIDE` extents, and more along its longer side.

        Args:
            place: x and y of the robot, m.
            extent: how far the robot stretches, m.
            width, height: size of the picture, dots.
        """
        ahead = np.zeros(2) if self._ahead is None else self._ahead
        zoom = min(width / AHEAD, height / ASIDE) / extent
        size = np.array([width, height]) / zoom
        return GroundArea(place + _FORWARD * size * ahead, size, zoom)


def frame_road(root: Floats, width: float, height: float) -> PerspectiveCamera:
    """Return a camera above a road, in whose picture the robot's heading is up.

    Args:
        root: pose of the robot, shape (7,).
        width, height: size of the picture, dots.
    """
    zoom = max(height / ROAD_SPAN, min(max(width, height) / ROAD_SPAN, _ROAD_ZOOM))
    x, y = heading_on_ground(root)
    azimuth = math.atan2(y, x) - math.pi / 2 if x or y else 0.0
    place = (float(root[0]), float(root[1]), 0.0)
    return PerspectiveCamera(place, 90.0, ROAD_SPAN, zoom, (width / 2, height * _ROAD_ROBOT), azimuth)


def heading_on_ground(root: Floats) -> Floats:
    """Return the ground direction of a pose's x axis, shape (2,); zeros if it points up or down."""
    ahead: Floats = rotate_vectors(root[3:], np.array([1.0, 0.0, 0.0]))[:2]
    length = float(np.linalg.norm(ahead))
    return ahead / length if length > 1e-6 else np.zeros(2)


def measure_stretch(links: Sequence[Link], root: Floats, ends: Floats) -> float:
    """Return how far the ends of links, shape (N, 2, 3), reach from the root, m."""
    radii = np.array([min(link.size) for link in links])
    return float((np.linalg.norm(ends - root[:3], axis=-1).max(axis=-1) + radii).max())
