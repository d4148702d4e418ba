"""The heatmap of all hidden units, with marks under the stimulated ones."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.color import Color
from textual.strip import Strip

from pdtui.core.errors import PolicyError
from pdtui.core.units import split_flat_index
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.strip.natural_outputs import NaturalOutputs
from pdtui.tui.strip.stimulation_marks import MAX_MARKED, draw_stimulation_marks, sum_up_stimulation
from pdtui.tui.strip.unit_grid import UnitGrid, allocate_layer_rows, last_first_layer
from pdtui.tui.strip.unit_picked import UnitPicked
from pdtui.tui.theme import HEAT_LEVELS, STYLES
from pdtui.tui.widgets.unit_table import behaviors_of_units

_LABEL = 4  # width of the layers' numbers, in cells
_OVERWRITTEN, _CURSOR = "◆", "◇"
_Cells = dict[tuple[int, int], tuple[str, Style]]
_NO_CELLS: _Cells = {}


class ActivationHeatmap(SnapshotWidget):
    """Draws two rows of pixels per line in half blocks: cold is negative, warm is positive, dark is zero.

    The rows are divided among the layers, and the strip scrolls where not all have room. A layer's units run
    down its rows, then right; if it has more units than pixels, a pixel shows the strongest of its units.
    """

    BORDER_TITLE = "hidden units"
    _scale = 1e-6
    _first = 0  # layer that is shown first
    _cursor = -1  # unit that the unit bench points to

    def scroll_layers(self, change: int) -> None:
        """Scroll by so many layers, as far as there are any."""
        if self.facts is not None:
            self._first = max(0, min(self._first + change, last_first_layer(self.facts.layers, self._rows)))
            self.redraw()

    def point_to(self, unit: int) -> None:
        """Mark a unit, by its flat index, and scroll to its layer; −1 for none."""
        if self.facts is not None and unit >= 0:
            layer = split_flat_index(unit, self.facts.layers)[0]
            if not allocate_layer_rows(self.facts.layers, self._rows, self._first)[layer][1]:
                self._first = min(layer, last_first_layer(self.facts.layers, self._rows))
        self._cursor = unit
        self.redraw()

    @property
    def _rows(self) -> int:
        """Number of pixel rows."""
        return 2 * max(1, self.content_size.height - 1)

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
        layers = self.facts.layers
        places = allocate_layer_rows(layers, lines * 2, min(self._first, last_first_layer(layers, lines * 2)))
        self._write_title(places)
        pixels = np.full((lines * 2, columns), -1, np.int64)
        first = 0
        for (top, rows), units in zip(places, layers, strict=True):
            values = self.snapshot.activations[first : first + units]
            if rows:
                pixels[top : top + rows] = self._levels(values, rows, columns)
            first += units
        cells = self._mark_cells(pixels, places)
        return [
            *(self._line(pixels[2 * line : 2 * line + 2], line, places, cells) for line in range(lines)),
            self._marks(width, columns, places),
        ]

    def _write_title(self, places: list[tuple[int, int]]) -> None:
        assert self.facts is not None
        shown = [layer for layer, (_, rows) in enumerate(places) if rows]
        widths = " · ".join(f"layer {layer}: {self.facts.layers[layer]}" for layer in shown)
        hidden = len(places) - len(shown)
        more = f" · {hidden} more: PgUp PgDn" if hidden else ""
        title = f"hidden units · {widths}{more}"
        if title != self.border_title:
            self.border_title = title

    def _levels(self, values: NDArray[np.float32], rows: int, columns: int) -> NDArray[np.int64]:
        """Return the color numbers of a layer's pixels, −1 for none, shape (rows, columns)."""
        strongest = UnitGrid(len(values), rows, columns).spread(np.nan_to_num(values))
        share = np.clip(strongest / self._scale, -1.0, 1.0)
        level = np.round(share * HEAT_LEVELS).astype(np.int64) + HEAT_LEVELS
        return np.where(np.isnan(strongest), -1, level)

    def _line(
        self, pixels: NDArray[np.int64], line: int, places: list[tuple[int, int]], cells: _Cells = _NO_CELLS
    ) -> Strip:
        starting = [str(layer) for layer, (top, rows) in enumerate(places) if rows and top // 2 == line]
        label = "/".join(starting).rjust(_LABEL - 1)[: _LABEL - 1] + " "
        segments = [Segment(label, STYLES.muted)]
        pairs = pixels[0] * 1000 + pixels[1]
        cuts = {0, len(pairs), *(np.flatnonzero(pairs[1:] != pairs[:-1]) + 1).tolist()}
        own = {column: cell for (at, column), cell in cells.items() if at == line}
        cuts.update(edge for column in own for edge in (column, column + 1))
        heat, (uppers, lowers) = STYLES.heat, pixels.tolist()
        for a, b in pairwise(sorted(cuts)):
            if a in own:
                segments.append(Segment(*own[a]))
                continue
            upper, lower = uppers[a], lowers[a]
            text = "▀" if upper >= 0 or lower >= 0 else " "
            style = _style(heat[upper] if upper >= 0 else None, heat[lower] if lower >= 0 else None)
            segments.append(Segment(text * (b - a), style))
        return Strip(segments, _LABEL + pixels.shape[1])

    def _mark_cells(self, pixels: NDArray[np.int64], places: list[tuple[int, int]]) -> _Cells:
        """Return what stands in the cells of overwritten units, and in that of the marked unit."""
        assert self.facts is not None
        assert self.snapshot is not None
        units = [view.unit for view in self.snapshot.stimulated_units]
        marked = units if len(units) <= MAX_MARKED else []
        names = behaviors_of_units(self.map, self.snapshot.active_behaviors, self.facts.layers)
        cells: _Cells = {}
        for unit in [*marked, *([self._cursor] if self._cursor >= 0 else [])]:
            place = self._pixel_of(unit, pixels.shape[1], places)
            if place is None:
                continue
            level = int(pixels[place])
            heat = STYLES.heat[level] if level >= 0 else None
            is_cursor = unit == self._cursor
            style = STYLES.title if is_cursor else self._style_of(names.get(unit, ""))
            sign = _CURSOR if is_cursor and unit not in units else _OVERWRITTEN
            cells[place[0] // 2, place[1]] = sign, style + _style(None, heat)
        return cells

    def _marks(self, width: int, columns: int, places: list[tuple[int, int]]) -> Strip:
        assert self.facts is not None
        assert self.snapshot is not None
        units, layers = self.snapshot.stimulated_units, self.facts.layers
        if len(units) > MAX_MARKED:
            return sum_up_stimulation(units, layers, width)
        names = behaviors_of_units(self.map, self.snapshot.active_behaviors, layers)

        def column_of(unit: int) -> int:
            place = self._pixel_of(unit, columns, places)
            return 0 if place is None else place[1] + _LABEL

        return draw_stimulation_marks(
            units,
            layers,
            width,
            column_of,
            lambda unit: self._style_of(names.get(unit, "")),
            NaturalOutputs(self.facts, self.snapshot),
        )

    def _style_of(self, behavior: str) -> Style:
        """Return the style of a behavior's units; those that the operator holds have none."""
        return STYLES.behavior(self.row_of(behavior)) if behavior else STYLES.accent

    def _pixel_of(self, unit: int, columns: int, places: list[tuple[int, int]]) -> tuple[int, int] | None:
        """Return row and column of the pixel that shows a unit; None where its layer is not shown."""
        assert self.facts is not None
        try:
            layer, index = split_flat_index(unit, self.facts.layers)
        except PolicyError:
            return None
        top, rows = places[layer]
        if not rows:
            return None
        grid = UnitGrid(self.facts.layers[layer], rows, columns)
        return top + grid.row_of(index), grid.column_of(index)

    def on_mouse_scroll_down(self) -> None:
        self.scroll_layers(1)

    def on_mouse_scroll_up(self) -> None:
        self.scroll_layers(-1)

    def on_click(self, event: events.Click) -> None:
        """Pick the unit under the mouse; of several in a cell, the strongest, which is the one seen."""
        offset = event.get_content_offset(self)
        if offset is None or self.facts is None or self.snapshot is None or offset.x < _LABEL:
            return
        columns, layers = self.content_size.width - _LABEL, self.facts.layers
        first = min(self._first, last_first_layer(layers, self._rows))
        flat, found = 0, list[int]()
        for (top, rows), units in zip(allocate_layer_rows(layers, self._rows, first), layers, strict=True):
            for row in (2 * offset.y, 2 * offset.y + 1):
                if top <= row < top + rows:
                    grid = UnitGrid(units, rows, columns)
                    found += [flat + index for index in grid.units_at(row - top, offset.x - _LABEL)]
            flat += units
        if found:
            values = np.abs(np.nan_to_num(self.snapshot.activations))
            self.post_message(UnitPicked(max(found, key=lambda unit: values[unit])))


@lru_cache(maxsize=1024)
def _style(upper: Color | None, lower: Color | None) -> Style:
    return Style(
        color=None if upper is None else upper.rich_color, bgcolor=None if lower is None else lower.rich_color
    )
