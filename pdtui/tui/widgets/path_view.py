"""The path from above, in the colours of the behaviors active along it."""

from __future__ import annotations

from math import atan2, ceil, log2, pi

import numpy as np
from numpy.typing import NDArray
from textual.strip import Strip

from pdtui.core.attributes import Floats
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.pictures.perspective_camera import round_length_down
from pdtui.robots.geometry import root_body_row, rotate_vectors
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.cell_text import format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES

_ARROWS = "→↗↑↖←↙↓↘"
_LEAST_SIZE = 2.0  # of the area shown, m
MOST_POINTS = 5000
_JUMP = 1.0  # longest step that is drawn as a line, m
_FARTHEST = 1e9  # coordinates beyond it, in m, come from a simulation that diverges and are not drawn
_PAST, _NONE, _MARK, _LABEL, _FIRST_BEHAVIOR = range(5)


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
        path = path[(np.abs(path) < _FARTHEST).all(axis=1)]
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


class PathView(SnapshotWidget):
    """Draws the whole present path, with +x to the right and +y up."""

    BORDER_TITLE = "path"

    def on_mount(self) -> None:
        self.trail = PathTrail()
        self._heading = 0.0
        self._here = np.zeros(2)

    def remember(self, snapshot: DriveSnapshot) -> None:
        self.trail.extend(snapshot.path, restarted=snapshot.restarted)
        if self.facts is not None and len(snapshot.poses):
            root = snapshot.poses[root_body_row(self.facts.links)]
            if (np.abs(root) < _FARTHEST).all():  # else the mark stays where it was
                ahead = rotate_vectors(root[3:], np.array([1.0, 0.0, 0.0]))
                self._here = root[:2]
                self._heading = atan2(float(ahead[1]), float(ahead[0]))

    def paint(self, width: int, height: int) -> list[Strip]:
        points = self.trail.points
        if not len(points):
            return []
        canvas = BrailleCanvas(width, height)
        middle, zoom = self._frame(canvas, points[:, :2])

        def place(world: Floats) -> Floats:
            centre = np.array([canvas.width / 2, canvas.height / 2])
            dots: Floats = centre + (world - middle) * np.array([zoom, -zoom])
            return dots

        old_starts, old_ends, _ = self.trail.line_segments(past=True)
        canvas.draw_segments(place(old_starts), place(old_ends), _PAST)
        starts, ends, rows = self.trail.line_segments()
        count = len(STYLES.behaviors)
        inks = np.where(rows < 0, _NONE, _FIRST_BEHAVIOR + rows % count).astype(np.int16)
        canvas.draw_segments(place(starts), place(ends), inks)
        self._mark(canvas, place(points[0, :2]), "○")
        self._mark(canvas, place(self._here), _ARROWS[round(self._heading / (pi / 4)) % 8])
        self._draw_scale(canvas, zoom)
        return canvas.render_strips(
            [STYLES.faint, STYLES.text, STYLES.accent, STYLES.muted, *STYLES.behaviors]
        )

    def _frame(self, canvas: BrailleCanvas, points: Floats) -> tuple[Floats, float]:
        """Return the middle of the picture in m and the number of dots per m.

        The scale moves in steps of √2 and the middle in whole cells, so that the picture rarely
        moves.
        """
        low, high = points.min(axis=0), points.max(axis=0)
        room = np.array([canvas.width - 6, canvas.height - 6])
        needed = float(np.max(np.maximum(high - low, _LEAST_SIZE) / room))
        zoom = 1.0 / 2.0 ** (ceil(log2(needed) * 2) / 2)
        cell = 4.0 / zoom
        middle: Floats = np.round((low + high) / 2 / cell) * cell
        return middle, zoom

    def _mark(self, canvas: BrailleCanvas, dot: Floats, character: str) -> None:
        canvas.draw_text(int(dot[0]) // 2, int(dot[1]) // 4, character, _MARK)

    def _draw_scale(self, canvas: BrailleCanvas, zoom: float) -> None:
        length = round_length_down(max(canvas.columns // 3, 4) * 2 / zoom)
        cells = max(2, round(length * zoom / 2))
        label = format_number(length).removesuffix(".00") + " m"
        canvas.draw_text(0, canvas.rows - 1, "├" + "─" * (cells - 2) + "┤ " + label, _LABEL)
