"""Small plots of attributes over time: a row of blocks, or two rows of dots with zero and the ghost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.style import Style
from textual.strip import Strip

from pdtui.core.attributes import Floats
from pdtui.tui.braille_canvas import DOTS_X, DOTS_Y, BrailleCanvas
from pdtui.tui.cell_text import format_number
from pdtui.tui.theme import STYLES

ROWS_PER_PLOT = 2
_LEVELS = np.array([ord(character) for character in " ▁▂▃▄▅▆▇█"], "<u4")
_LEAST_SHARE = 0.05  # of the range so far, to which a plot is scaled at least
_DOTS = ROWS_PER_PLOT * DOTS_Y
_DOTS_PER_ZERO, _DOTS_PER_GHOST = 3, 2  # from one dot of a dotted line to the next
_ZERO, _GHOST, _FIRST_OWN = range(3)


class PlotScales(NamedTuple):
    """The values at the lower and the upper end of each plot, shape (J,); NaN for one without values."""

    bottom: Floats
    top: Floats

    @property
    def crosses_zero(self) -> NDArray[np.bool_]:
        """Whether 0 lies between the ends, shape (J,)."""
        return (self.bottom < 0.0) & (self.top > 0.0)

    def scale_to_unit(self, values: Floats) -> Floats:
        """Return how high values (n, J) lie: 0 at the lower end, 1 at the upper end."""
        shares: Floats = (values - self.bottom) / (self.top - self.bottom)
        return shares


def fit_scales(values: Floats, low: Floats, high: Floats) -> PlotScales:
    """Return the scales of plots that show values (n, J), of which some may be NaN.

    Each has the values' range, but no less than a twentieth of the range `low` to `high` seen so far, so that
    noise stays small.
    """
    known = np.isfinite(values)
    bottom = np.where(known, values, np.inf).min(axis=0, initial=np.inf)
    top = np.where(known, values, -np.inf).max(axis=0, initial=-np.inf)
    with np.errstate(invalid="ignore"):
        span = np.maximum(top - bottom, np.maximum(_LEAST_SHARE * (high - low), 1e-9))
        middle = (top + bottom) / 2
        return PlotScales(middle - span / 2, middle + span / 2)


def draw_sparklines(means: Floats, scales: PlotScales) -> list[str]:
    """Return one line of block characters per column of means (cells, J)."""
    with np.errstate(invalid="ignore"):
        share = np.nan_to_num(scales.scale_to_unit(means))
    level = np.where(np.isfinite(means), 1 + np.clip(share * 8, 0, 7), 0).astype(np.int64)
    text = _LEVELS[level.T]
    return [row.tobytes().decode("utf-32-le") for row in text]


def draw_line_plots(own: Floats, ghost: Floats, scales: PlotScales, styles: Sequence[Style]) -> list[Strip]:
    """Return two lines per column of means (2 × cells, J): the drive's line, the ghost's and that of zero.

    The ghost's is dotted, since cells that both cross have the color of the drive's.
    """
    points, plots = own.shape
    canvas = BrailleCanvas(points // DOTS_X, plots * ROWS_PER_PLOT)
    x = np.arange(points) + 0.5

    def dot_rows(values: Floats) -> Floats:
        """The rows of dots of values (n, J), shape (n, J)."""
        with np.errstate(invalid="ignore"):
            within = np.clip(scales.scale_to_unit(values), 0.0, 1.0)
        rows: Floats = np.arange(plots) * _DOTS + 0.5 + (1.0 - within) * (_DOTS - 1)
        return rows

    def draw_dots(rows: Floats, distance: int, ink: int) -> None:
        columns = np.broadcast_to(x[::distance, None], rows[::distance].shape)
        shown = np.isfinite(rows[::distance])
        canvas.draw_points(columns[shown], rows[::distance][shown], ink)

    zeros = np.where(scales.crosses_zero, 0.0, np.nan)
    draw_dots(dot_rows(np.broadcast_to(zeros, own.shape)), _DOTS_PER_ZERO, _ZERO)
    draw_dots(dot_rows(ghost), _DOTS_PER_GHOST, _GHOST)
    rows = dot_rows(own)
    line = np.stack([np.broadcast_to(x[:, None], rows.shape), rows], axis=-1)
    starts, ends = line[:-1].reshape(-1, 2), line[1:].reshape(-1, 2)
    inks = np.tile(np.arange(plots, dtype=np.int16) + _FIRST_OWN, points - 1)
    canvas.draw_segments(starts, ends, inks.astype(np.int16))
    return canvas.render_strips([STYLES.faint, STYLES.ghost, *styles])


def split_marked_text(text: str, marked: NDArray[np.bool_]) -> list[tuple[str, bool]]:
    """Return the parts of a text in which all characters are marked, or none is, and which of the two."""
    cuts = [0, *(np.flatnonzero(marked[1:] != marked[:-1]) + 1).tolist(), len(text)]
    return [(text[a:b], bool(marked[a])) for a, b in pairwise(cuts) if a < b]


def format_scale_limit(value: float, span: float) -> str:
    """Format an end of a scale with as many digits as tell it from the other, in about 6 characters."""
    if not math.isfinite(value):
        return ""
    digits = min(2, max(0, 1 - math.floor(math.log10(max(span, 1e-9)))))
    return _format_digits(value, digits) if abs(value) < 1000 else format_number(value)


def format_range(low: float, high: float, width: int) -> str:
    """Format both ends of a scale with as many digits as fit; if none do, or an end is NaN, nothing."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return ""
    for digits in (2, 1, 0):
        said = f"{_format_digits(low, digits)}…{_format_digits(high, digits)}"
        if len(said) <= width:
            return said
    return ""


def _format_digits(value: float, digits: int) -> str:
    shown = f"{value:.{digits}f}"
    return (shown.lstrip("-") if float(shown) == 0.0 else shown).replace("-", "−")
