"""A canvas of braille dots, with 2 × 4 dots and one ink per terminal cell."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from pdtui.core.attributes import Floats

DOTS_X, DOTS_Y = 2, 4
# Unicode numbers the dots of a braille cell column by column, the lowest row (7 and 8) last.
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], np.uint32)
_EMPTY, _SPACE = 0x2800, 0x20


class BrailleCanvas:
    """Dots, inks and a few characters on a grid of cells.

    x runs right and y runs down, both in dots, from the canvas's upper left corner; a dot covers a unit
    square whose center has coordinates ending in .5. What lies outside is cut off. A cell shows the ink that
    was drawn there last.

    Args:
        columns, rows: size in terminal cells.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self.columns, self.rows = columns, rows
        self.width, self.height = columns * DOTS_X, rows * DOTS_Y
        self.dots = np.zeros((self.height, self.width), np.bool_)
        self.inks = np.zeros((rows, columns), np.int16)
        self._characters: list[tuple[int, int, str, int]] = []

    def draw_points(self, x: NDArray[Any], y: NDArray[Any], ink: int | NDArray[np.int16]) -> None:
        """Set the dots under points (n,)."""
        column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        inside = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        column, row = column[inside], row[inside]
        self.dots[row, column] = True
        self.inks[row // DOTS_Y, column // DOTS_X] = ink if isinstance(ink, int) else ink[inside]

    def draw_segments(self, starts: Floats, ends: Floats, ink: int | NDArray[np.int16]) -> None:
        """Draw lines between points (n, 2), with one ink for all or one ink per line, shape (n,)."""
        kept = _near(starts, ends, self.width, self.height)
        starts, ends = starts[kept], ends[kept]
        steps = np.ceil(np.abs(ends - starts).max(axis=-1, initial=0.0)).astype(np.int64) + 1
        which = np.repeat(np.arange(len(starts)), steps)
        first = np.cumsum(steps) - steps
        place = (np.arange(len(which)) - first[which]) / np.maximum(steps[which] - 1, 1)
        drawn = starts[which] + (ends - starts)[which] * place[:, None]
        self.draw_points(drawn[:, 0], drawn[:, 1], ink if isinstance(ink, int) else ink[kept][which])

    def draw_capsule(self, start: Floats, end: Floats, radius: float, ink: int, *, halo: float = 0.0) -> None:
        """Fill all dots within `radius` of a line, and clear a rim of `halo` dots around it.

        A line whose ends coincide is a disc. The rim separates a near limb from a far one behind it.
        """
        reach = max(radius, 0.5) + halo
        low = np.floor(np.minimum(start, end) - reach).astype(int)
        high = np.ceil(np.maximum(start, end) + reach).astype(int)
        x0, y0 = max(low[0], 0), max(low[1], 0)
        x1, y1 = min(high[0], self.width), min(high[1], self.height)
        if x0 >= x1 or y0 >= y1:
            return
        dx = np.arange(x0, x1) + 0.5 - start[0]
        dy = (np.arange(y0, y1) + 0.5 - start[1])[:, None]
        ax, ay = end - start
        length = ax * ax + ay * ay
        along = np.clip((dx * ax + dy * ay) / length, 0.0, 1.0) if length > 0 else 0.0
        distance = np.hypot(dx - along * ax, dy - along * ay)
        patch = self.dots[y0:y1, x0:x1]
        if halo:
            patch &= distance > reach
        filled = distance <= max(radius, 0.5)
        patch |= filled
        row, column = np.nonzero(filled)
        self.inks[(row + y0) // DOTS_Y, (column + x0) // DOTS_X] = ink

    def draw_polygon(self, corners: Floats, ink: int, *, halo: float = 0.0) -> None:
        """Fill a convex polygon, corners (n, 2) in either order, and clear a rim of `halo` dots around it.

        Of one that covers the middle of no dot, the outline is drawn.
        """
        size = np.array([self.width, self.height])
        low = np.clip(np.floor(corners.min(axis=0) - halo), 0, size)
        high = np.clip(np.ceil(corners.max(axis=0) + halo), 0, size)
        if not (low < high).all():  # outside, or not finite
            return
        (x0, y0), (x1, y1) = low.astype(int), high.astype(int)
        x, y = np.arange(x0, x1) + 0.5, (np.arange(y0, y1) + 0.5)[:, None]
        edges = np.roll(corners, -1, axis=0) - corners
        area = np.sum(corners[:, 0] * np.roll(corners[:, 1], -1) - corners[:, 1] * np.roll(corners[:, 0], -1))
        inward = np.full((y1 - y0, x1 - x0), np.inf)
        for (cx, cy), (dx, dy) in zip(corners, edges, strict=True):
            distance = np.sign(area) * (dx * (y - cy) - dy * (x - cx)) / max(float(np.hypot(dx, dy)), 1e-9)
            inward = np.minimum(inward, distance)
        self.dots[y0:y1, x0:x1] &= inward < -halo
        row, column = np.nonzero(inward > 0)
        self.draw_points(column + x0, row + y0, ink)
        if not len(row):
            self.draw_segments(corners, np.roll(corners, -1, axis=0), ink)

    def draw_text(self, column: int, row: int, text: str, ink: int) -> None:
        """Write characters, each one cell wide, over the dots."""
        if 0 <= row < self.rows:
            start = max(0, -column)
            cut = text[start : max(start, self.columns - column)]
            if cut:
                self._characters.append((column + start, row, cut, ink))

    def cell_codes(self) -> NDArray[np.uint32]:
        """Return the code point of every cell's character, shape (rows, columns)."""
        cells = self.dots.reshape(self.rows, DOTS_Y, self.columns, DOTS_X)
        codes: NDArray[np.uint32] = np.einsum("ryct,yt->rc", cells, _BITS, dtype=np.uint32)
        codes += np.uint32(_EMPTY)
        codes[codes == _EMPTY] = _SPACE
        return codes

    def render_strips(self, styles: Sequence[Style]) -> list[Strip]:
        """Return the canvas as lines; an ink is an index into `styles`."""
        codes, inks = self.cell_codes(), self.inks.copy()
        for column, row, text, ink in self._characters:
            codes[row, column : column + len(text)] = [ord(character) for character in text]
            inks[row, column : column + len(text)] = ink
        # Blanks take the ink to their left, which saves segments.
        places = np.where(codes != _SPACE, np.arange(self.columns), 0)
        shown = np.take_along_axis(inks, np.maximum.accumulate(places, axis=1), axis=1)
        changes = shown[:, 1:] != shown[:, :-1]
        text = codes.astype("<u4").tobytes().decode("utf-32-le")
        strips = []
        for row, own in enumerate(shown.tolist()):
            line = text[row * self.columns : (row + 1) * self.columns]
            cuts = [0, *(np.flatnonzero(changes[row]) + 1).tolist(), self.columns]
            strips.append(
                Strip([Segment(line[a:b], styles[own[a]]) for a, b in pairwise(cuts)], self.columns)
            )
        return strips


def _near(starts: Floats, ends: Floats, width: int, height: int) -> NDArray[np.bool_]:
    """Return which lines may touch the canvas and are finite and short enough to draw."""
    size = np.array([width, height], np.float64)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    touching = (high >= 0).all(-1) & (low <= size).all(-1)
    near: NDArray[np.bool_] = touching & ((high - low) <= 4 * size.max()).all(-1)
    return near
