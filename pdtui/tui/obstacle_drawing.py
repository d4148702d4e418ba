"""Drawing obstacles: discs from above, trunks from the side."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.tui.braille_canvas import BrailleCanvas

_ON_GROUND = np.array([1.0, 1.0, 0.0])
"""Makes the place on the ground of x, y and radius."""
_LEAST = 1.0
"""Radius of the smallest disc, in dots: larger than a dot of the ground."""


def draw_obstacles_from_above(
    canvas: BrailleCanvas, camera: PerspectiveCamera, obstacles: Floats, ink: int
) -> None:
    """Draw a disc per obstacle, with a rim that keeps the ground grid away."""
    dots, magnification, before = camera.project(obstacles * _ON_GROUND)
    for dot, scale, radius in zip(dots[before], magnification[before], obstacles[before, 2], strict=True):
        canvas.draw_capsule(dot, dot, max(_LEAST, float(radius * scale) * camera.zoom), ink, halo=1.0)


def draw_obstacles_from_side(
    canvas: BrailleCanvas, camera: PerspectiveCamera, obstacles: Floats, ink: int, *, behind: bool
) -> None:
    """Draw a trunk per obstacle, far ones first; in front of the robot only its outline, which hides nothing.

    The height of obstacles is unknown, so trunks reach to the picture's edge. `obstacles` are x, y and radius
    in m, shape (N, 3); those behind the robot are drawn if `behind`, otherwise those in front of it.
    """
    chosen = obstacles[(obstacles[:, 1] > camera.target[1]) == behind]
    chosen = chosen[np.argsort(-chosen[:, 1], kind="stable")]
    feet, magnification, before = camera.project(chosen * _ON_GROUND)
    widths = chosen[:, 2] * magnification * camera.zoom
    for row in np.flatnonzero(before):
        foot, top = feet[row], np.array([feet[row, 0], min(feet[row, 1], 0.0)])
        if behind:
            canvas.draw_capsule(foot, top, float(widths[row]), ink, halo=1.0)
        else:
            sides = np.array([[-widths[row], 0.0], [widths[row], 0.0]])
            canvas.draw_segments(foot + sides, top + sides, ink)
