"""The table of kinematic attributes: present value, target and recent history."""

from __future__ import annotations

from math import ceil, pi

import numpy as np
from rich.cells import cell_len
from textual.strip import Strip

from pdtui.core.printable_text import make_printable
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.sparkline import AttributeHistory, draw_sparklines

_SECONDS = 12.0
_ROWS_KEPT = 4096
_VALUE, _UNIT, _TARGET = 7, 5, 10
_FORCES = ("N", "N m", "Nm")


class AttributeTable(SnapshotWidget):
    """Shows one attribute per line; if not all fit, forces and torques are left out first."""

    _history: AttributeHistory | None = None

    def on_mount(self) -> None:
        """Set the title."""
        self.border_title = "attributes"

    def remember(self, snapshot: DriveSnapshot) -> None:
        if self._history is None:
            self._history = AttributeHistory(_ROWS_KEPT, len(snapshot.attributes))
        self._history.extend(snapshot.history)

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.facts is None:
            return [ScreenRow(width).add("waiting for the policy", self.palette.faint).strip()]
        shown = self._choose(height)
        attributes = [self.facts.attributes[index] for index in shown]
        widest = max(cell_len(make_printable(attribute.name)) for attribute in attributes)
        holds = any(behavior.pid is not None for behavior in self.map.behaviors.values())
        target_width = _TARGET if holds else 0
        fixed = _VALUE + _UNIT + target_width + 3
        name_width = min(widest, max(8, width - fixed - 12))
        cells = max(0, width - fixed - name_width)
        lines = self._sparklines(shown, cells) if self._history is not None else [""] * len(shown)
        targets = self._targets()
        values = None if self.snapshot is None else self.snapshot.attributes
        palette, strips = self.palette, []
        for index, attribute, line in zip(shown, attributes, lines, strict=True):
            target, row = targets.get(attribute.name, (None, -1))
            name_style = palette.text if target is None else palette.behavior(row)
            value = "" if values is None else format_number(float(values[index]))
            strips.append(
                ScreenRow(width)
                .add(make_printable(attribute.name), name_style, name_width)
                .add(" " + value, palette.title, _VALUE + 1, right=True)
                .add(" " + make_printable(attribute.unit), palette.muted, _UNIT + 1)
                .add("" if target is None else f"→ {format_number(target)}", name_style, target_width)
                .add(" " + line, palette.primary if target is None else palette.behavior(row))
                .strip()
            )
        return strips

    def _choose(self, height: int) -> list[int]:
        """Return the indices of the attributes to show, in the robot's order."""
        assert self.facts is not None
        named = {primitive.attribute for primitive in self.map.primitives.values()}
        for behavior in self.map.behaviors.values():
            named |= {part.attribute for part in (behavior.aim, behavior.pid) if part is not None}

        def rank(index: int) -> tuple[bool, bool, int]:
            assert self.facts is not None
            attribute = self.facts.attributes[index]
            force = attribute.unit in _FORCES
            return force, attribute.name not in named, index

        return sorted(sorted(range(len(self.facts.attributes)), key=rank)[:height])

    def _targets(self) -> dict[str, tuple[float, int]]:
        """Return target and behavior row of each attribute that a controller holds."""
        targets: dict[str, tuple[float, int]] = {}
        for active in self.snapshot.active if self.snapshot is not None else ():
            behavior = self.map.behaviors.get(active.name)
            if behavior is not None and behavior.pid is not None and active.target is not None:
                targets[behavior.pid.attribute] = (active.target, self.row_of(active.name))
        return targets

    def _sparklines(self, shown: list[int], cells: int) -> list[str]:
        assert self.facts is not None
        assert self._history is not None
        if cells <= 0:
            return [""] * len(shown)
        per_cell = min(max(1, ceil(_SECONDS / self.facts.dt / cells)), _ROWS_KEPT // cells)
        means = self._history.means(cells, per_cell)[:, shown]
        low, high = self._history.low[shown], self._history.high[shown]
        # An angle is scaled to several turns, so that its jump at ±π stays small in the line.
        for column, index in enumerate(shown):
            if self.facts.attributes[index].wraps and np.nanmax(np.abs(means[:, column]), initial=0.0) > 1.5:
                low[column], high[column] = -20 * pi, 20 * pi
        return draw_sparklines(means, low, high)
