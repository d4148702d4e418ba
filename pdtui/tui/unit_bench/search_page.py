"""The page that finds units that raise or lower an attribute now."""

from __future__ import annotations

from typing import ClassVar

from textual.strip import Strip

from pdtui.core.drive_edits import write_edit
from pdtui.core.printable_text import make_printable
from pdtui.core.units import format_unit
from pdtui.driving.unit_bench.unit_search_snapshot import FoundUnit, UnitSearchRequest
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import ScreenRow, format_number, format_signed
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_page import BenchPage, BenchServices

_QUESTIONS = 2


class SearchPage(BenchPage):
    """An attribute, a direction, and the three best units that a bounded search has found."""

    TAB: ClassVar[str] = "search"
    KEYS: ClassVar[str] = "←→ choose  ↵ search; on a unit: hold it"

    def __init__(self, stimulation_map: StimulationMap, bench: BenchServices, *, id: str) -> None:
        super().__init__(stimulation_map, bench, id=id)
        self._column, self._sign = 0, 1.0

    def count_rows(self) -> int:
        return _QUESTIONS + len(self._found())

    def draw_row(self, row: int, line: ScreenRow, *, marked: bool) -> None:
        if self.facts is None:
            return
        style = STYLES.title if marked else STYLES.text
        arrows = "‹ › " if marked and row < _QUESTIONS else "    "
        if row == 0:
            line.add(arrows, STYLES.accent).add("attribute  ", STYLES.muted)
            line.add(make_printable(self.facts.attributes[self._column].name), style)
        elif row == 1:
            line.add(arrows, STYLES.accent).add("direction  ", STYLES.muted)
            line.add("raise" if self._sign > 0 else "lower", style)
        else:
            self._draw_found(self._found()[row - _QUESTIONS], line, marked=marked)

    def draw_foot(self, width: int, lines: int) -> list[Strip]:
        search = None if self.snapshot is None else self.snapshot.unit_search
        if search is None or self.facts is None:
            said = "↵: 20 s of roll-outs from now on, in a process of its own"
        elif search.condition == "failed":
            return [ScreenRow(width).add(make_printable(search.message), STYLES.bad).strip()]
        elif search.condition == "loading":
            said = "loading robot and policy…"
        else:
            request, seconds = search.request, search.steps * self.facts.dt
            what = "" if request is None else f"{request.attribute} "
            verb = "searching" if search.condition == "searching" else "done"
            said = f"{verb}: {what}from step {search.step}, {search.rollouts} roll-outs of {seconds:.1f} s"
        return [ScreenRow(width).add(make_printable(said), STYLES.muted).strip()][:lines]

    def change(self, presses: int) -> None:
        if self.facts is None:
            return
        if self.marked == 0:
            self._column = (self._column + presses) % len(self.facts.attributes)
        elif self.marked == 1:
            self._sign = -self._sign

    def choose(self) -> None:
        if self.facts is None:
            return
        if self.marked < _QUESTIONS:
            name = self.facts.attributes[self._column].name
            self.bench.find_units(UnitSearchRequest(name, self._sign))
            return
        found = self._found()[self.marked - _QUESTIONS]
        self.bench.send(write_edit("unit", format_unit(found.unit, self.facts.layers), found.value))

    def row_was_marked(self) -> None:
        found = self._found()
        self.bench.point_to(found[self.marked - _QUESTIONS].unit if self.marked >= _QUESTIONS else -1)

    def _draw_found(self, found: FoundUnit, line: ScreenRow, *, marked: bool) -> None:
        assert self.facts is not None
        assert self.snapshot is not None
        held = dict(self.snapshot.held_units).get(found.unit) == found.value
        search = self.snapshot.unit_search
        name = "" if search is None or search.request is None else search.request.attribute
        unit = {one.name: one.unit for one in self.facts.attributes}.get(name, "")
        line.add("● " if held else "○ ", STYLES.accent if held else STYLES.faint)
        line.add(format_unit(found.unit, self.facts.layers), STYLES.title if marked else STYLES.text, 8)
        line.add(f"= {format_number(found.value)}", STYLES.text, 10)
        line.add(f"{name} {format_signed(found.effect)} {unit}", STYLES.good)
        line.add("  falls" if found.fell else "", STYLES.bad)

    def _found(self) -> tuple[FoundUnit, ...]:
        search = None if self.snapshot is None else self.snapshot.unit_search
        return () if search is None else search.best
