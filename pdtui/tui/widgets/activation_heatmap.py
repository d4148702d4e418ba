"""The heatmap of all hidden units, with marks under the stimulated ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from textual.color import Color
from textual.strip import Strip

from pdtui.core.units import format_unit, split_flat_index
from pdtui.driving.drive_snapshot import DriveSnapshot, StimulatedUnit
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import HEAT_LEVELS, STYLES
from pdtui.tui.widgets.unit_table import behaviors_of_units

_LABEL = 4  # width of the layers' numbers, in cells

if TYPE_CHECKING:
    from pdtui.driving.drive_snapshot import DriveFacts

# More stimulated units than this are summed up.
_MAX_MARKED = 16


class ActivationHeatmap(SnapshotWidget):
    """Draws two rows of pixels per line in half blocks: cold is negative, warm is positive, dark is zero.

    The rows are divided among the layers. A layer's units run down its rows, then right; if it has more units
    than pixels, a pixel shows the strongest of its units.
    """

    BORDER_TITLE = "hidden units"
    _scale = 1e-6

    def watch_facts(self, old: DriveFacts | None, facts: DriveFacts | None) -> None:
        if self.facts is not None:
            widths = enumerate(self.facts.layers)
            layers = " · ".join(f"layer {layer}: {width}" for layer, width in widths)
            self.border_title = f"hidden units · {layers}"
        super().watch_facts(old, facts)

    def remember(self, snapshot: DriveSnapshot) -> None:
        finite = np.abs(snapshot.activations[np.isfinite(snapshot.activations)])
        # Not every activation function is bounded as tanh is, and a few overwritten units must not darken all
        # others. So the scale is the 98 % quantile; its maximum so far decays slowly.
        if finite.size:
            self._scale = max(self._scale * 0.998, float(np.quantile(finite, 0.98)), 1e-6)

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.facts is None or self.snapshot is None:
            return []
        columns = width - _LABEL
        lines = max(1, height - 1)
        places = allocate_layer_rows(len(self.facts.layers), lines * 2)
        pixels = np.zeros((lines * 2, columns), np.int64)
        first = 0
        for layer, units in enumerate(self.facts.layers):
            values = self.snapshot.activations[first : first + units]
            top, rows = places[layer]
            if rows:
                pixels[top : top + rows] = self._levels(values, rows, columns)
            first += units
        return [
            *(self._line(pixels[2 * line : 2 * line + 2], line, places) for line in range(lines)),
            self._marks(width, columns, places),
        ]

    def _levels(self, values: NDArray[np.float32], rows: int, columns: int) -> NDArray[np.int64]:
        """Return the colour numbers of a layer's pixels, −1 for none, shape (rows, columns)."""
        strongest = UnitGrid(len(values), rows, columns).spread(np.nan_to_num(values))
        share = np.clip(strongest / self._scale, -1.0, 1.0)
        level = np.round(share * HEAT_LEVELS).astype(np.int64) + HEAT_LEVELS
        return np.where(np.isnan(strongest), -1, level)

    def _line(self, pixels: NDArray[np.int64], line: int, places: list[tuple[int, int]]) -> Strip:
        starting = [str(layer) for layer, (top, rows) in enumerate(places) if rows and top // 2 == line]
        label = "/".join(starting).rjust(_LABEL - 1)[: _LABEL - 1] + " "
        segments = [Segment(label, STYLES.muted)]
        pairs = pixels[0] * 1000 + pixels[1]
        cuts = [0, *(np.flatnonzero(pairs[1:] != pairs[:-1]) + 1).tolist(), len(pairs)]
        for a, b in pairwise(cuts):
            upper, lower = int(pixels[0, a]), int(pixels[1, a])
            text = "▀" if max(upper, lower) >= 0 else " "
            style = _style(*(STYLES.heat[level] if level >= 0 else None for level in (upper, lower)))
            segments.append(Segment(text * (b - a), style))
        return Strip(segments, _LABEL + pixels.shape[1])

    def _marks(self, width: int, columns: int, places: list[tuple[int, int]]) -> Strip:
        """Return the line that marks stimulated units under their columns, with their values."""
        assert self.facts is not None
        assert self.snapshot is not None
        names = behaviors_of_units(self.map, self.snapshot.active_behaviors, self.facts.layers)
        units = sorted(self.snapshot.stimulated_units, key=lambda view: view.unit)
        if len(units) > _MAX_MARKED:
            return self._sum_up(width, units)
        marks = [(self._column(view, columns, places), view) for view in units]
        marks.sort(key=lambda mark: mark[0])
        row, hidden = ScreenRow(width), 0
        for index, (column, view) in enumerate(marks):
            style = STYLES.behavior(self.row_of(names.get(view.unit, "")))
            address = format_unit(view.unit, self.facts.layers)
            text = f"▲{address} {format_number(view.natural)}→{format_number(view.overwritten)} "
            at = width - row.left
            rest = sum(
                len(format_unit(other.unit, self.facts.layers)) + 16 for _, other in marks[index + 1 :]
            )
            target = max(at, min(column + _LABEL, width - len(text) - rest))
            if target + len(text) > width:
                hidden += 1
                continue
            row.add(" " * (target - at), style).add(text, style)
        if hidden and row.left >= 4:
            row.add(f"+{hidden}".rjust(row.left), STYLES.muted)
        return row.strip()

    def _sum_up(self, width: int, units: list[StimulatedUnit]) -> Strip:
        """Return the line that says how many units of each layer are changed, and how far on average."""
        assert self.facts is not None
        changes: dict[int, list[float]] = {}
        for view in units:
            layer = split_flat_index(view.unit, self.facts.layers)[0]
            changes.setdefault(layer, []).append(abs(view.overwritten - view.natural))
        row = ScreenRow(width)
        for layer, sizes in changes.items():
            mean = format_number(sum(sizes) / len(sizes))
            text = f"▲ {len(sizes)} units of layer {layer} changed by {mean} on average  "
            if len(text) <= row.left:
                row.add(text, STYLES.accent)
        return row.strip()

    def _column(self, view: StimulatedUnit, columns: int, places: list[tuple[int, int]]) -> int:
        assert self.facts is not None
        layer, index = split_flat_index(view.unit, self.facts.layers)
        rows = max(1, places[layer][1])
        return UnitGrid(self.facts.layers[layer], rows, columns).column_of(index)


@lru_cache(maxsize=1024)
def _style(upper: Color | None, lower: Color | None) -> Style:
    return Style(
        color=None if upper is None else upper.rich_color, bgcolor=None if lower is None else lower.rich_color
    )


def allocate_layer_rows(layers: int, rows: int) -> list[tuple[int, int]]:
    """Return the first pixel row and the number of pixel rows per layer; layers without room get none."""
    each = max(1, rows // layers)
    return [(layer * each, each if (layer + 1) * each <= rows else 0) for layer in range(layers)]


@dataclass(frozen=True)
class UnitGrid:
    """The places of a layer's units, which run down, then right, on `rows` × `columns` pixels.

    Fewer units than pixels are drawn wider, so that a layer always fills its rows; if there are more units
    than pixels, neighbours share one.
    """

    units: int
    rows: int
    columns: int

    @property
    def steps(self) -> int:
        """Number of different columns."""
        return min(self.columns, -(-self.units // self.rows))

    def column_of(self, index: int) -> int:
        """Return the leftmost column that shows a unit."""
        groups = self.rows * self.steps
        group = index * groups // self.units if self.units > groups else index
        return -(-(group // self.rows) * self.columns // self.steps)

    def spread(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the values as pixels, shape (rows, columns): the strongest of several, NaN for none."""
        groups = self.rows * self.steps
        if self.units > groups:
            group = np.arange(self.units) * groups // self.units
            starts = np.searchsorted(group, np.arange(groups))
            high, low = np.maximum.reduceat(values, starts), np.minimum.reduceat(values, starts)
            shown = np.where(high >= -low, high, low)
        else:
            shown = np.full(groups, np.nan, np.float32)
            shown[: self.units] = values
        pixels: NDArray[np.float32] = shown.reshape(self.steps, self.rows).T
        return pixels[:, np.arange(self.columns) * self.steps // self.columns]
