"""The table of stimulated units: natural output and the value that overwrites it."""

from __future__ import annotations

from collections.abc import Sequence

from rich.cells import cell_len
from textual import events
from textual.strip import Strip

from pdtui.core.errors import PolicyError
from pdtui.core.printable_text import make_printable
from pdtui.core.step_record import ActiveBehavior
from pdtui.core.units import format_unit, parse_unit
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.strip.natural_outputs import NaturalOutputs
from pdtui.tui.strip.unit_picked import UnitPicked
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.scrolled_list import ScrolledList

_NUMBER, _ADDRESS = 8, 8  # widths of the columns, in cells


class UnitTable(ScrolledList):
    """Shows one unit per line, in the color of the behavior that overwrites it."""

    BORDER_TITLE = "stimulated units"

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.facts is None or self.snapshot is None or not self.snapshot.stimulated_units:
            text = "none: no unit is overwritten" if self.snapshot is not None else ""
            return [ScreenRow(width).add(text, STYLES.faint).strip()]
        head = (
            ScreenRow(width)
            .add("unit", STYLES.muted, _ADDRESS)
            .add("natural", STYLES.muted, _NUMBER, right=True)
        )
        head.add("    overwritten  by itself", STYLES.muted)
        names = behaviors_of_units(self.map, self.snapshot.active_behaviors, self.facts.layers)
        strips = [head.strip()]
        units = self.snapshot.stimulated_units
        room = height - 1 if len(units) < height else height - 2
        self._hidden = max(0, len(units) - room)
        self._first = min(self._first, self._hidden)
        natural = NaturalOutputs(self.facts, self.snapshot)
        for view in units[self._first : self._first + room]:
            has = natural.has(view.unit, view.overwritten)
            name = names.get(view.unit, "")
            style = STYLES.behavior(self.row_of(name)) if name else STYLES.accent
            row = (
                ScreenRow(width)
                .add(format_unit(view.unit, self.facts.layers), style, _ADDRESS)
                .add(format_number(view.natural), STYLES.muted, _NUMBER, right=True)
                .add("  → ", STYLES.faint)
                .add(format_number(view.overwritten) + ("" if has else "!"), STYLES.title, _NUMBER)
                .add(natural.describe_range(view.unit), STYLES.faint if has else STYLES.warn)
            )
            if row.left > cell_len(make_printable(name)):
                row.add(" " + make_printable(name), style)
            strips.append(row.strip())
        if self._hidden:
            strips.append(ScreenRow(width).add(f"+{self._hidden} more: scroll", STYLES.faint).strip())
        return strips

    def on_click(self, event: events.Click) -> None:
        """Pick the unit under the mouse."""
        offset = event.get_content_offset(self)
        units = () if self.snapshot is None else self.snapshot.stimulated_units
        if offset is not None and 1 <= offset.y <= min(
            len(units) - self._first, self.content_size.height - 1
        ):
            self.post_message(UnitPicked(units[self._first + offset.y - 1].unit))


def behaviors_of_units(
    stimulation_map: StimulationMap, active: Sequence[ActiveBehavior], layers: Sequence[int]
) -> dict[int, str]:
    """Return, for each overwritten unit, the behavior that decides its value: the one latched last."""
    names: dict[int, str] = {}
    for view in active:
        behavior = stimulation_map.behaviors.get(view.name)
        for address in stimulation_map.units_of(behavior) if behavior is not None else ():
            try:
                names[parse_unit(address, layers)] = view.name
            except PolicyError:
                continue  # the drive refuses such a map with a message of its own
    return names
