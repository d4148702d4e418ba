"""The picture of a world without links, in half blocks."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.tui.cell_text import ScreenRow
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES

# Of each color, four bits are kept, so that neighbors are often the same.
_KEPT_BITS, _MIDDLE = np.uint8(0xF0), np.uint8(0x08)


class WorldPicture(SnapshotWidget):
    """Draws two rows of pixels per line, as large as the pane allows without distorting the picture."""

    BORDER_TITLE = "world"

    def forget(self) -> None:
        self._picture: NDArray[np.uint8] | None = None

    def remember(self, snapshot: DriveSnapshot) -> None:
        if snapshot.picture is not None:
            self._picture = snapshot.picture

    def paint(self, width: int, height: int) -> list[Strip]:
        if self._picture is None:
            return [ScreenRow(width).add("waiting for the picture", STYLES.faint).strip()]
        pixels = fit_picture(self._picture, 2 * height, width)
        pixels = (pixels & _KEPT_BITS) | _MIDDLE
        lines, columns = len(pixels) // 2, pixels.shape[1]
        left = (width - columns) // 2
        margin = [Segment(" " * left)] if left else []
        blank = [Strip.blank(width)] * ((height - lines) // 2)
        return blank + [
            Strip(
                [
                    *margin,
                    *_line(pixels[2 * row], pixels[2 * row + 1]),
                    Segment(" " * (width - left - columns)),
                ]
            )
            for row in range(lines)
        ]


def fit_picture(picture: NDArray[np.uint8], most_rows: int, most_columns: int) -> NDArray[np.uint8]:
    """Return the nearest pixels of a picture (rows, columns, 3) in the largest size that fits.

    The number of rows is even.
    """
    rows, columns = picture.shape[:2]
    scale = min(most_rows / rows, most_columns / columns)
    high = max(2, int(rows * scale) // 2 * 2)
    wide = max(1, min(most_columns, round(columns * scale)))
    down = ((np.arange(high) + 0.5) * rows / high).astype(np.int64)
    across = ((np.arange(wide) + 0.5) * columns / wide).astype(np.int64)
    fitted: NDArray[np.uint8] = picture[down[:, None], across]
    return fitted


def _line(upper: NDArray[np.uint8], lower: NDArray[np.uint8]) -> list[Segment]:
    """Return half blocks for two rows of pixels (columns, 3), equal neighbors in one segment."""
    changes = (upper[1:] != upper[:-1]).any(axis=1) | (lower[1:] != lower[:-1]).any(axis=1)
    cuts = [0, *(np.flatnonzero(changes) + 1).tolist(), len(upper)]
    tops, bottoms = upper.tolist(), lower.tolist()
    return [Segment("▀" * (b - a), _style(tuple(tops[a]), tuple(bottoms[a]))) for a, b in pairwise(cuts)]


@lru_cache(maxsize=8192)
def _style(upper: tuple[int, int, int], lower: tuple[int, int, int]) -> Style:
    return Style(color=Color.from_rgb(*upper), bgcolor=Color.from_rgb(*lower))
