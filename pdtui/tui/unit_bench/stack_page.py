"""The page of the stack: several behaviors at once, with their order and factors."""

from __future__ import annotations

from typing import ClassVar

from textual.strip import Strip

from pdtui.core.drive_edits import FACTOR_STEP, write_edit
from pdtui.core.printable_text import make_printable
from pdtui.core.units import MAX_LISTED, format_unit
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.stimulation.stack.stack_entry import StackEntry, find_conflicts
from pdtui.tui.cell_text import ScreenRow, displayed_key_name, format_number
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_page import BenchPage


class StackPage(BenchPage):
    """The latched behaviors, that which decides last on top, and below them those that could be latched."""

    TAB: ClassVar[str] = "layers"
    KEYS: ClassVar[str] = "←→ ×  ↵ mute/add  ⇧↑↓ order  Del end"
    _behavior = ""  # of the marked behavior, which stays marked where the stack changes

    def remember(self, snapshot: DriveSnapshot) -> None:
        names = [*(layer.name for layer in reversed(snapshot.stack)), *self._others_of(snapshot)]
        if self._behavior in names:
            self.marked = names.index(self._behavior)

    def row_was_marked(self) -> None:
        layer, others = self._marked_layer(), self._others()
        row = self.marked - len(self._stack())
        self._behavior = layer.name if layer is not None else others[row] if 0 <= row < len(others) else ""
        self.bench.point_to(-1)

    def count_rows(self) -> int:
        return len(self._stack()) + len(self._others())

    def draw_row(self, row: int, line: ScreenRow, *, marked: bool) -> None:
        if self.facts is None or self.snapshot is None:
            return
        stack, others = self._stack(), self._others()
        if row >= len(stack):
            name = others[row - len(stack)]
            behavior = self.map.behaviors[name]
            line.add(f"+ {make_printable(name)}", STYLES.title if marked else STYLES.muted, line.width // 2)
            line.add(f" {displayed_key_name(behavior.key)}", STYLES.faint)
            line.add("  ↵ beside the others" if marked else "", STYLES.muted)
            return
        layer = stack[row]
        style = STYLES.faint if layer.muted else STYLES.behavior(self.row_of(layer.name))
        line.add("○ " if layer.muted else "● ", style)
        line.add(make_printable(layer.name), style, min(16, line.width // 3))
        line.add(f" ×{format_number(layer.factor)}", STYLES.title if marked else STYLES.text, 8)
        line.add("muted " if layer.muted else "", STYLES.warn)
        conflicts = sorted(self._conflicts() & set(layer.units))
        if conflicts and not layer.muted:
            shown = [format_unit(unit, self.facts.layers) for unit in conflicts[:MAX_LISTED]]
            more = f" +{len(conflicts) - MAX_LISTED}" if len(conflicts) > MAX_LISTED else ""
            line.add(f"shares {' '.join(shown)}{more}", STYLES.warn)
        else:
            line.add("1 unit" if len(layer.units) == 1 else f"{len(layer.units)} units", STYLES.muted)

    def draw_head(self, width: int) -> list[Strip]:
        held = () if self.snapshot is None else self.snapshot.held_units
        if not held:
            return []
        said = "one unit" if len(held) == 1 else f"{len(held)} units"
        return [ScreenRow(width).add(f" ● {said} held on the bench, above all", STYLES.accent).strip()]

    def change(self, presses: int) -> None:
        if (layer := self._marked_layer()) is not None:
            self.bench.send(write_edit("factor", layer.name, layer.factor * FACTOR_STEP**presses))

    def choose(self) -> None:
        layer = self._marked_layer()
        if layer is not None:
            self.bench.send(write_edit("unmute" if layer.muted else "mute", layer.name))
        elif others := self._others():
            self.bench.send(write_edit("beside", others[self.marked - len(self._stack())]))

    def take_off(self) -> None:
        if (layer := self._marked_layer()) is not None:
            self.bench.send(write_edit("release", layer.name))

    def reorder(self, direction: int) -> None:
        layer = self._marked_layer()
        if layer is None:
            return
        place = len(self._stack()) - 1 - self.marked + direction
        if 0 <= place < len(self._stack()):
            self.bench.send(write_edit("order", layer.name, place))

    def type_value(self, begun: str) -> None:
        if (layer := self._marked_layer()) is not None:
            self.bench.ask_number(
                f"factor of {layer.name}",
                begun,
                lambda value: self.bench.send(write_edit("factor", layer.name, value)),
            )

    def _stack(self) -> list[StackEntry]:
        return [] if self.snapshot is None else list(reversed(self.snapshot.stack))

    def _others(self) -> list[str]:
        return self._others_of(self.snapshot)

    def _others_of(self, snapshot: DriveSnapshot | None) -> list[str]:
        latched = set() if snapshot is None else {layer.name for layer in snapshot.stack}
        return [name for name in self.map.behaviors if name not in latched]

    def _marked_layer(self) -> StackEntry | None:
        stack = self._stack()
        return stack[self.marked] if self.marked < len(stack) else None

    def _conflicts(self) -> frozenset[int]:
        assert self.snapshot is not None
        return find_conflicts(self.snapshot.stack, [unit for unit, _ in self.snapshot.held_units])
