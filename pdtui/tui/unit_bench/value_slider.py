"""A slider for the output of a unit, on which its natural range is marked."""

from __future__ import annotations

import math
from typing import NamedTuple

from rich.style import Style

from pdtui.tui.cell_text import ScreenRow
from pdtui.tui.theme import STYLES

_STEPS = 20  # of a key, over the natural range
_BESIDE = 1.0  # natural ranges that the slider reaches to either side
_LEAST_SPAN = 0.02


class SliderScale(NamedTuple):
    """The ends of a slider, and of the natural range on it."""

    low: float
    high: float
    natural_low: float
    natural_high: float

    @property
    def step(self) -> float:
        """The change of one press of a key."""
        return (self.natural_high - self.natural_low) / _STEPS

    def cell_of(self, value: float, cells: int) -> int:
        """Return the cell of a value; one beyond an end is in the last cell there."""
        if math.isnan(value):
            return 0
        share = (value - self.low) / (self.high - self.low)
        return round(min(max(share, 0.0), 1.0) * (cells - 1))

    def value_at(self, cell: int, cells: int) -> float:
        """Return the value of a cell, rounded to a tenth of a key's step or finer."""
        value = self.low + (self.high - self.low) * min(max(cell, 0), cells - 1) / max(1, cells - 1)
        return round(value, 3)


def fit_slider(natural: tuple[float, float] | None, value: float) -> SliderScale:
    """Return the scale of a slider: the natural range, as much again on either side, and the value."""
    low, high = natural if natural is not None else (-1.0, 1.0)
    if high - low < _LEAST_SPAN:
        middle = (low + high) / 2
        low, high = middle - _LEAST_SPAN / 2, middle + _LEAST_SPAN / 2
    beside = _BESIDE * (high - low)
    value = value if math.isfinite(value) else low
    return SliderScale(min(low - beside, value), max(high + beside, value), low, high)


def draw_slider(
    row: ScreenRow, cells: int, scale: SliderScale, value: float, now: float, knob: Style
) -> None:
    """Add a slider to a line: thick over the natural range, with a bar at the unit's own output now."""
    first, last = scale.cell_of(scale.natural_low, cells), scale.cell_of(scale.natural_high, cells)
    at, own = scale.cell_of(value, cells), scale.cell_of(now, cells)
    for cell in range(cells):
        inside = first <= cell <= last
        if cell == at:
            row.add("●", knob)
        elif cell == own:
            row.add("│", STYLES.title)
        else:
            row.add("━" if inside else "─", STYLES.muted if inside else STYLES.faint)
