"""The path from above, in the colours of the behaviors active along it."""

from __future__ import annotations

from math import atan2, ceil, log2, pi

import numpy as np
from textual.strip import Strip

from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.robots.geometry import root_body, rotate
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.cell_text import format_number
from pdtui.tui.path_trail import PathTrail
from pdtui.tui.perspective_camera import Floats, round_length_down
from pdtui.tui.snapshot_widget import SnapshotWidget

_ARROWS = "→↗↑↖←↙↓↘"
_LEAST_SIZE = 2.0
_PAST, _NONE, _MARK, _LABEL, _FIRST_BEHAVIOR = range(5)


class PathView(SnapshotWidget):
    """Draws the whole present path, with +x to the right and +y up."""

    def on_mount(self) -> None:
        """Set the title and start with no path."""
        self.border_title = "path"
        self.trail = PathTrail()
        self._heading = 0.0
        self._here = np.zeros(2)

    def remember(self, snapshot: DriveSnapshot) -> None:
        self.trail.extend(snapshot.path, restarted=snapshot.restarted)
        if self.facts is not None and len(snapshot.poses):
            root = snapshot.poses[root_body(self.facts.links)]
            ahead = rotate(root[3:], np.array([1.0, 0.0, 0.0]))
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
        count = len(self.palette.behaviors)
        inks = np.where(rows < 0, _NONE, _FIRST_BEHAVIOR + rows % count).astype(np.int16)
        canvas.draw_segments(place(starts), place(ends), inks)
        self._mark(canvas, place(points[0, :2]), "○")
        self._mark(canvas, place(self._here), _ARROWS[round(self._heading / (pi / 4)) % 8])
        self._draw_scale(canvas, zoom)
        palette = self.palette
        return canvas.render_strips(
            [palette.faint, palette.text, palette.accent, palette.muted, *palette.behaviors]
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
