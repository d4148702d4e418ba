"""The page of single units: pick them, and hold them at outputs."""

from __future__ import annotations

import math
from typing import ClassVar

from textual import events
from textual.strip import Strip

from pdtui.core.drive_edits import write_edit
from pdtui.core.errors import PolicyError
from pdtui.core.printable_text import make_printable
from pdtui.core.units import format_unit, parse_unit, split_flat_index
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.strip.natural_outputs import NaturalOutputs
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_page import BenchPage, BenchServices, draw_differences
from pdtui.tui.unit_bench.bench_units import BenchUnits
from pdtui.tui.unit_bench.value_slider import SliderScale, draw_slider, fit_slider

_ADDRESS, _VALUE = 8, 8  # widths of columns, in cells
_SLIDER = 4 + _ADDRESS + _VALUE + 1
"""Cells before a slider."""


class UnitPage(BenchPage):
    """One row per unit with its slider, and a last row that walks along the strip to pick another one."""

    TAB: ClassVar[str] = "units"
    KEYS: ClassVar[str] = "←→ value  = type  ↵ hold/free  ^S save"

    def __init__(self, stimulation_map: StimulationMap, bench: BenchServices, *, id: str) -> None:
        super().__init__(stimulation_map, bench, id=id)
        self.units = BenchUnits()
        self._walk = 0
        self._dragged: int | None = None

    def remember(self, snapshot: DriveSnapshot) -> None:
        self.units.follow(snapshot)

    def count_rows(self) -> int:
        return len(self.units.rows) + 1

    def pick(self, unit: int) -> None:
        """Mark the row of a unit, which is put on the bench at its present output if it is not there."""
        if self.snapshot is not None and self.facts is not None and 0 <= unit < sum(self.facts.layers):
            self._walk = unit
            self.mark(self.units.pick(unit, round(self._output_of(unit), 3)))

    def draw_row(self, row: int, line: ScreenRow, *, marked: bool) -> None:
        if self.facts is None or self.snapshot is None:
            return
        natural = NaturalOutputs(self.facts, self.snapshot)
        if row == len(self.units.rows):
            address = format_unit(self._walk, self.facts.layers)
            line.add(f"+ {address} ", STYLES.title if marked else STYLES.muted, _ADDRESS + 3)
            line.add(format_number(self._output_of(self._walk)), STYLES.muted, _VALUE, right=True)
            known = natural.describe_range(self._walk)
            line.add(f"  {known}" if known else "", STYLES.faint)
            line.add("  ←→ walk, ↵ pick" if marked else "", STYLES.muted)
            return
        one = self.units.rows[row]
        line.add("● " if one.held else "○ ", STYLES.accent if one.held else STYLES.faint)
        line.add(format_unit(one.unit, self.facts.layers), STYLES.title if marked else STYLES.text, _ADDRESS)
        line.add(format_number(one.value), STYLES.title if one.held else STYLES.muted, _VALUE, right=True)
        line.add(" " if natural.has(one.unit, one.value) else "!", STYLES.warn).add(" ", STYLES.text)
        knob = STYLES.accent if one.held else STYLES.muted
        draw_slider(line, line.left, self._scale(row), one.value, self._natural_of(one.unit), knob)

    def draw_foot(self, width: int, lines: int) -> list[Strip]:
        if self.facts is None or self.snapshot is None:
            return []
        attributes = self.facts.attributes
        names = [make_printable(one.name) for one in attributes]
        shown = draw_differences(
            self.bench.differences, names, [one.unit for one in attributes], self.facts.dt, width, lines
        )
        if not shown and self.snapshot.ghost is None:
            hint = "^G: a ghost shows what the units change"
            return [ScreenRow(width).add(hint, STYLES.faint).strip()]
        return shown

    def change(self, presses: int) -> None:
        if self.facts is None or self.snapshot is None:
            return
        if self.marked == len(self.units.rows):
            self._walk = (self._walk + presses) % sum(self.facts.layers)
            self.row_was_marked()
            return
        one, step = self.units.rows[self.marked], self._scale(self.marked).step
        self._hold(self.marked, self._round(one.value + presses * step, step))

    def choose(self) -> None:
        if self.facts is None:
            return
        if self.marked == len(self.units.rows):
            self.pick(self._walk)
            return
        one = self.units.rows[self.marked]
        if one.held:
            self.units.edit(self.marked, one.value, held=False)
            self.bench.send(write_edit("free", format_unit(one.unit, self.facts.layers)))
        else:
            self._hold(self.marked, one.value)

    def take_off(self) -> None:
        if self.marked < len(self.units.rows):
            if self.units.rows[self.marked].held:
                self.choose()
            self.units.forget(self.marked)
            self.row_was_marked()

    def type_value(self, begun: str) -> None:
        if self.facts is None:
            return
        if self.marked == len(self.units.rows):
            self.bench.ask("unit", begun, self._pick_typed)
        else:
            address = format_unit(self.units.rows[self.marked].unit, self.facts.layers)
            self.bench.ask_number(f"output of {address}", begun, self._hold_typed)

    def row_was_marked(self) -> None:
        rows = self.units.rows
        self.bench.point_to(rows[self.marked].unit if self.marked < len(rows) else self._walk)

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of a slider."""
        row = self.row_at(event)
        offset = event.get_content_offset(self)
        if row is not None and offset is not None and row < len(self.units.rows) and offset.x >= _SLIDER:
            self.mark(row)
            self._dragged = row
            self.capture_mouse()
            self._drag_to(offset.x)

    def on_mouse_move(self, event: events.MouseMove) -> None:
        if self._dragged is not None:
            self._drag_to(event.x - self.gutter.left)

    def on_mouse_up(self) -> None:
        if self._dragged is not None:
            self._dragged = None
            self.release_mouse()

    def _drag_to(self, x: int) -> None:
        row = self._dragged
        if row is None or row >= len(self.units.rows):
            return
        cells = self.content_size.width - _SLIDER
        value = self._scale(row).value_at(x - _SLIDER, cells)
        if value != self.units.rows[row].value or not self.units.rows[row].held:
            self._hold(row, value)
            self.redraw()

    def _hold(self, row: int, value: float) -> None:
        assert self.facts is not None
        self.units.edit(row, value, held=True)
        self.bench.send(write_edit("unit", format_unit(self.units.rows[row].unit, self.facts.layers), value))

    def _hold_typed(self, value: float) -> None:
        if self.marked < len(self.units.rows):
            self._hold(self.marked, value)
            self.redraw()

    def _pick_typed(self, text: str) -> str:
        assert self.facts is not None
        try:
            unit = parse_unit(text.strip(), self.facts.layers)
        except PolicyError as error:
            return str(error)
        self.pick(unit)
        return ""

    def _scale(self, row: int) -> SliderScale:
        assert self.facts is not None
        assert self.snapshot is not None
        one = self.units.rows[row]
        return fit_slider(NaturalOutputs(self.facts, self.snapshot).range_of(one.unit), one.value)

    @staticmethod
    def _round(value: float, step: float) -> float:
        """Round to so many digits that a step stays what it is."""
        return round(value, max(0, 2 - math.floor(math.log10(step))))

    def _output_of(self, unit: int) -> float:
        assert self.snapshot is not None
        value = float(self.snapshot.activations[unit]) if unit < len(self.snapshot.activations) else 0.0
        return value if math.isfinite(value) else 0.0

    def _natural_of(self, unit: int) -> float:
        """Return what a unit would put out now by itself."""
        assert self.snapshot is not None
        own = {view.unit: view.natural for view in self.snapshot.stimulated_units}
        return own.get(unit, self._output_of(unit))

    def walk_layers(self, change: int) -> None:
        """Walk to the first unit of another layer."""
        if self.facts is not None:
            layer = split_flat_index(self._walk, self.facts.layers)[0]
            wanted = max(0, min(layer + change, len(self.facts.layers) - 1))
            self._walk = sum(self.facts.layers[:wanted])
            self.mark(len(self.units.rows))
