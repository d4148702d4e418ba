"""Drawing roads and traffic: lines, boxes and what a lidar hits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.core.scenery import BoxKind, LineKind, RoadLine, Traffic
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.robots.geometry import rotate_vectors
from pdtui.tui.braille_canvas import BrailleCanvas

_AROUND = ((-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5))
BOX_CORNERS = np.array([(x, y, z) for z in (-0.5, 0.5) for x, y in _AROUND])
"""Corners of a box of size 1: the lower four in their order around it, then the upper four, shape (8, 3)."""
_BOX_EDGES = np.array(
    [(a, b) for a in range(8) for b in range(a + 1, 8) if (BOX_CORNERS[a] != BOX_CORNERS[b]).sum() == 1]
)
"""Rows of the corners at both ends of each edge, shape (12, 2)."""
_ORDER: tuple[LineKind, ...] = ("broken lane line", "solid lane line", "road edge", "route")
"""Kinds of lines as they are drawn, the later over the earlier: junctions are full of lines of lanes."""


class RoadLineDrawing:
    """The lines of roads, cut into straight segments once per world.

    Args:
        lines: the lines.
        inks: index of the ink of each kind of line.
    """

    def __init__(self, lines: tuple[RoadLine, ...], inks: dict[LineKind, int]) -> None:
        ordered = sorted(lines, key=lambda line: _ORDER.index(line.kind))
        pieces = [(piece, inks[line.kind]) for line in ordered for piece in line.painted_pieces()]
        empty = np.empty((0, 3))
        self._starts: Floats = np.concatenate([empty, *(piece[:-1] for piece, _ in pieces)])
        self._ends: Floats = np.concatenate([empty, *(piece[1:] for piece, _ in pieces)])
        self._inks: NDArray[np.int16] = np.repeat(
            np.array([ink for _, ink in pieces], np.int16), [len(piece) - 1 for piece, _ in pieces]
        )

    def draw(self, canvas: BrailleCanvas, camera: PerspectiveCamera) -> None:
        """Draw those segments that lie in front of the camera."""
        starts, _, before = camera.project(self._starts)
        ends, _, also_before = camera.project(self._ends)
        kept = before & also_before
        canvas.draw_segments(starts[kept], ends[kept], self._inks[kept])


def compute_box_corners(link: Link, pose: Floats) -> Floats:
    """Return the corners of a box with this pose in the world, shape (8, 3), ordered as `BOX_CORNERS`."""
    return pose[:3] + rotate_vectors(pose[3:], BOX_CORNERS * 2 * np.array(link.size))


def draw_box_edges(canvas: BrailleCanvas, corners: Floats, ink: int) -> None:
    """Draw the edges of a box whose `BOX_CORNERS` are at these dots, shape (8, 2)."""
    canvas.draw_segments(corners[_BOX_EDGES[:, 0]], corners[_BOX_EDGES[:, 1]], ink)


def draw_lidar_hits(canvas: BrailleCanvas, camera: PerspectiveCamera, hits: Floats, ink: int) -> None:
    """Draw a dot per point that a lidar hits, shape (M, 2), m."""
    dots, _, before = camera.project(np.concatenate([hits, np.zeros((len(hits), 1))], axis=1))
    canvas.draw_points(dots[before, 0], dots[before, 1], ink)


def draw_traffic(
    canvas: BrailleCanvas,
    camera: PerspectiveCamera,
    traffic: Traffic,
    inks: dict[BoxKind, int],
    *,
    filled: bool,
) -> None:
    """Draw boxes, filled for a camera above them, or else their edges."""
    turns = traffic.poses[:, 3]
    local = BOX_CORNERS * traffic.sizes[:, None, :]
    corners = np.empty_like(local)
    corners[..., 0] = local[..., 0] * np.cos(turns)[:, None] - local[..., 1] * np.sin(turns)[:, None]
    corners[..., 1] = local[..., 0] * np.sin(turns)[:, None] + local[..., 1] * np.cos(turns)[:, None]
    corners[..., 2] = local[..., 2]
    dots, _, before = camera.project(corners + traffic.poses[:, None, :3])
    for row in np.flatnonzero(before.all(axis=1)):
        ink = inks[traffic.kinds[row]]
        if filled:
            canvas.draw_polygon(dots[row, :4], ink, halo=1.0)
        else:
            draw_box_edges(canvas, dots[row], ink)


def draw_links_on_road(
    canvas: BrailleCanvas,
    camera: PerspectiveCamera,
    links: Sequence[Link],
    placed: Floats,
    ends: Floats,
    ink: int,
) -> None:
    """Draw links in one color, after the rims of all, so that none cuts into another.

    Args:
        canvas, camera: Where, and as seen from where.
        links: The links.
        placed: Their world poses, shape (L, 7).
        ends: Both ends of the axis of each, m, shape (L, 2, 3).
        ink: Number of the color.
    """
    dots = camera.project(ends)[0]
    for halo in (1.0, 0.0):
        for row, link in enumerate(links):
            if link.shape == "box":
                corners, _, _ = camera.project(compute_box_corners(link, placed[row]))
                canvas.draw_polygon(corners[:4], ink, halo=halo)
            else:
                canvas.draw_capsule(dots[row, 0], dots[row, 1], link.size[0] * camera.zoom, ink, halo=halo)
