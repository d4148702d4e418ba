"""The path from above, in the colors of the behaviors active along it, and the ghost's."""

from __future__ import annotations

from math import atan2, ceil, log2, pi

import numpy as np
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip

from pdtui.core.attributes import Floats
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.pictures.perspective_camera import round_length_down
from pdtui.robots.geometry import root_body_row, rotate_vectors
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.cell_text import format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.path_trail import MOST_POINTS, PathTrail, are_within_view

_ARROWS = "→↗↑↖←↙↓↘"
_LEAST_SIZE = 2.0  # of the area shown, m
STRETCHES: tuple[float | None, ...] = (5.0, 10.0, 20.0, 40.0, 80.0, None)
"""How much of the path can be shown: its last seconds, or all of it."""
_USUAL = STRETCHES.index(20.0)
_WITH_GHOST = 20.0  # seconds of path from which the ghost has to be in the picture
_PAST, _NONE, _MARK, _LABEL, _GHOST, _FIRST_BEHAVIOR = range(6)


class PathView(SnapshotWidget):
    """Draws the last seconds of the present path, or all of it, with +x to the right and +y up.

    What lies before, and the path before, are faint.
    """

    BORDER_TITLE = "path · last 20 s"
    stretch: reactive[int] = reactive(_USUAL, init=False, repaint=False)

    def forget(self) -> None:
        self.trail = PathTrail()
        self._ghost_path: Floats = np.empty((0, 2))
        self._ghost_first = -1
        self._heading = 0.0
        self._here = np.zeros(2)

    def on_mouse_scroll_up(self) -> None:
        """Show less of the path."""
        self.zoom(-1)

    def on_mouse_scroll_down(self) -> None:
        """Show more of the path."""
        self.zoom(1)

    def zoom(self, change: int) -> None:
        """Show more of the path for 1, less for −1."""
        self.stretch = min(max(self.stretch + change, 0), len(STRETCHES) - 1)

    def watch_stretch(self) -> None:
        seconds = STRETCHES[self.stretch]
        self.border_title = "path · all of it" if seconds is None else f"path · last {seconds:g} s"
        self.redraw()

    def remember(self, snapshot: DriveSnapshot) -> None:
        self.trail.extend(snapshot.path, restarted=snapshot.restarted)
        ghost = snapshot.ghost
        first = -1 if ghost is None else ghost.first
        if first != self._ghost_first:
            self._ghost_path, self._ghost_first = np.empty((0, 2)), first
        if ghost is not None and ghost.path is not None:
            near = ghost.path[are_within_view(ghost.path)]
            self._ghost_path = np.concatenate([self._ghost_path, near])[-MOST_POINTS:]
        if self.facts is not None and len(snapshot.poses):
            root = snapshot.poses[root_body_row(self.facts.links)]
            if are_within_view(root):  # else the mark stays where it was
                ahead = rotate_vectors(root[3:], np.array([1.0, 0.0, 0.0]))
                self._here = root[:2]
                self._heading = atan2(float(ahead[1]), float(ahead[0]))

    def paint(self, width: int, height: int) -> list[Strip]:
        points = self.trail.points
        if not len(points) or self.facts is None:
            return []
        canvas = BrailleCanvas(width, height)
        seconds = STRETCHES[self.stretch]
        steps = MOST_POINTS if seconds is None else max(1, round(seconds / self.facts.dt))
        shown = points if seconds is None else self.trail.recent[-steps - 1 :]
        ghost = self._ghost_path[-steps - 1 :]
        # Close up, the robot fills the picture, as the ghost may be far away.
        framed = ghost if seconds is None or seconds >= _WITH_GHOST else ghost[:0]
        middle, zoom = self._frame(canvas, np.concatenate([shown[:, :2], framed]))

        def place(world: Floats) -> Floats:
            center = np.array([canvas.width / 2, canvas.height / 2])
            dots: Floats = center + (world - middle) * np.array([zoom, -zoom])
            return dots

        for part in ("past", "present") if seconds is not None else ("past",):
            old_starts, old_ends, _ = self.trail.line_segments(part)
            canvas.draw_segments(place(old_starts), place(old_ends), _PAST)
        canvas.draw_segments(place(ghost[:-1]), place(ghost[1:]), _GHOST)
        starts, ends, rows = self.trail.line_segments("present" if seconds is None else "recent", steps)
        count = len(STYLES.behaviors)
        inks = np.where(rows < 0, _NONE, _FIRST_BEHAVIOR + rows % count).astype(np.int16)
        canvas.draw_segments(place(starts), place(ends), inks)
        self._mark(canvas, place(points[0, :2]), "○", _MARK)
        if len(ghost):
            self._mark(canvas, place(ghost[-1]), "◌", _GHOST)
        self._mark(canvas, place(self._here), _ARROWS[round(self._heading / (pi / 4)) % 8], _MARK)
        self._draw_scale(canvas, zoom)
        return canvas.render_strips(_inks())

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

    def _mark(self, canvas: BrailleCanvas, dot: Floats, character: str, ink: int) -> None:
        canvas.draw_text(int(dot[0]) // 2, int(dot[1]) // 4, character, ink)

    def _draw_scale(self, canvas: BrailleCanvas, zoom: float) -> None:
        length = round_length_down(max(canvas.columns // 3, 4) * 2 / zoom)
        cells = max(2, round(length * zoom / 2))
        label = format_number(length).removesuffix(".00") + " m"
        canvas.draw_text(0, canvas.rows - 1, "├" + "─" * (cells - 2) + "┤ " + label, _LABEL)


def _inks() -> tuple[Style, ...]:
    return (STYLES.faint, STYLES.text, STYLES.accent, STYLES.muted, STYLES.ghost, *STYLES.behaviors)
