"""The table of stimulated units: natural output and the value that overwrites it."""

from __future__ import annotations

from rich.cells import cell_len
from textual.strip import Strip

from pdtui.core.printable_text import make_printable
from pdtui.core.units import format_unit
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.unit_owners import unit_owners

_NUMBER = 8
_ADDRESS = 8


class UnitTable(SnapshotWidget):
    """Shows one unit per line, in the colour of the behavior that overwrites it."""

    def on_mount(self) -> None:
        """Set the title."""
        self.border_title = "stimulated units"

    def paint(self, width: int, height: int) -> list[Strip]:
        palette = self.palette
        if self.facts is None or self.snapshot is None or not self.snapshot.units:
            text = "none: no unit is overwritten" if self.snapshot is not None else ""
            return [ScreenRow(width).add(text, palette.faint).strip()]
        head = (
            ScreenRow(width)
            .add("unit", palette.muted, _ADDRESS)
            .add("natural", palette.muted, _NUMBER, right=True)
        )
        head.add("    overwritten", palette.muted)
        owner = unit_owners(self.map, self.snapshot.active, self.facts.layers)
        strips = [head.strip()]
        units = self.snapshot.units
        room = height - 1 if len(units) < height else height - 2
        for view in units[:room]:
            name = owner.get(view.unit, "")
            style = palette.behavior(self.row_of(name))
            row = (
                ScreenRow(width)
                .add(format_unit(view.unit, self.facts.layers), style, _ADDRESS)
                .add(format_number(view.natural), palette.muted, _NUMBER, right=True)
                .add("  → ", palette.faint)
                .add(format_number(view.overwritten), palette.title, _NUMBER)
            )
            if row.left > cell_len(make_printable(name)):
                row.add(" " + make_printable(name), style)
            strips.append(row.strip())
        if len(units) > room:
            strips.append(ScreenRow(width).add(f"+{len(units) - room} more", palette.faint).strip())
        return strips
