"""A page of the unit bench: rows, one of which is marked and can be changed."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar, Protocol

from textual import events
from textual.binding import Binding
from textual.strip import Strip

from pdtui.driving.unit_bench.unit_search_snapshot import UnitSearchRequest
from pdtui.search.gain_tuning_process import GainTuningState
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import ScreenRow, format_signed
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_entry import Answer
from pdtui.tui.unit_bench.ghost_differences import GhostDifferences

_BIG = 5  # presses that a press with shift counts for


class GainTuner(Protocol):
    """Tunes the gains of a behavior beside the drive."""

    @property
    def state(self) -> GainTuningState | None:
        """How the present tuning stands; None before the first."""

    def tune(self, behavior: str) -> str:
        """Begin to tune a behavior, unless a tuning is under way; return a notice for the user."""


class BenchServices(Protocol):
    """What the pages need of the bench.

    Attributes:
        differences: by how much the drive differs from its ghost.
        target: the map with what was saved into it during the drive.
        tuning: tunes gains; None where nothing can.
    """

    differences: GhostDifferences
    target: StimulationMap
    tuning: GainTuner | None

    def send(self, edit: str) -> None:
        """Send an edit to the drive."""

    def ask(self, what: str, before: str, answer: Answer) -> None:
        """Let the user type something."""

    def continue_typing(self, character: str | None) -> bool:
        """Add a character to the line in which something is typed, and return whether that was possible."""

    def ask_number(self, what: str, before: str, take: Callable[[float], None]) -> None:
        """Let the user type a number."""

    def find_units(self, request: UnitSearchRequest) -> None:
        """Search for units, from the present moment on."""

    def say(self, notice: str) -> None:
        """Show a notice."""

    def point_to(self, unit: int) -> None:
        """Mark a unit in the strip; −1 for none."""


class BenchPage(SnapshotWidget, can_focus=True):
    """Moves through its rows with the arrow keys and the mouse.

    Attributes:
        TAB: name of the page.
        KEYS: what its keys do, for the lower edge of the frame.
    """

    TAB: ClassVar[str] = ""
    KEYS: ClassVar[str] = ""
    BINDINGS: ClassVar = [
        Binding("up", "move(-1)", "the row above", id="bench_up"),
        Binding("down", "move(1)", "the row below", id="bench_down"),
        Binding("left", "change(-1)", "less", id="bench_less"),
        Binding("right", "change(1)", "more", id="bench_more"),
        Binding("shift+left", f"change(-{_BIG})", "much less", id="bench_much_less"),
        Binding("shift+right", f"change({_BIG})", "much more", id="bench_much_more"),
        Binding("shift+up", "reorder(1)", "up in the stack", id="bench_raise"),
        Binding("shift+down", "reorder(-1)", "down in the stack", id="bench_lower"),
        Binding("enter", "choose", "takes the row, or lets it go", id="bench_choose"),
        Binding("delete", "remove", "removes the row", id="bench_remove"),
        Binding("equals_sign", "type", "types a value", id="bench_type"),
    ]

    def __init__(self, stimulation_map: StimulationMap, bench: BenchServices, *, id: str) -> None:
        super().__init__(stimulation_map, id=id)
        self.bench = bench
        self.marked = 0

    @abstractmethod
    def count_rows(self) -> int:
        """Return the number of rows that can be marked."""

    @abstractmethod
    def draw_row(self, row: int, line: ScreenRow, *, marked: bool) -> None:
        """Add a row to a line whose first cell shows whether it is marked."""

    def draw_head(self, width: int) -> list[Strip]:
        """Return the lines above the rows."""
        del width
        return []

    def draw_foot(self, width: int, lines: int) -> list[Strip]:
        """Return the lines below the rows, at most so many."""
        del width, lines
        return []

    def change(self, presses: int) -> None:
        """Change the marked row by so many presses of a key, negative for less."""

    def choose(self) -> None:
        """Take the marked row, or let it go."""

    def take_off(self) -> None:
        """Remove the marked row."""

    def reorder(self, direction: int) -> None:
        """Move the marked row up for 1, down for −1."""

    def type_value(self, begun: str) -> None:
        """Let the user type the value of the marked row, which is begun with a text."""

    def save(self) -> bool:
        """Save what the page edits into the map, and return whether it edits anything of its own."""
        return False

    def row_was_marked(self) -> None:
        """Do what follows from another row having been marked."""

    def action_move(self, direction: int) -> None:
        self.mark(self.marked + direction)

    def action_change(self, presses: int) -> None:
        self.change(presses)
        self.redraw()

    def action_choose(self) -> None:
        self.choose()
        self.redraw()

    def action_remove(self) -> None:
        self.take_off()
        self.redraw()

    def action_reorder(self, direction: int) -> None:
        self.reorder(direction)
        self.redraw()

    def action_type(self) -> None:
        self.type_value("")

    def mark(self, row: int) -> None:
        """Mark a row, as far as there is one."""
        self.marked = max(0, min(row, self.count_rows() - 1))
        self.row_was_marked()
        self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Let = or a digit begin a value, unless it is the key of a behavior.

        What is typed fast may arrive here after the line has been opened for it.
        """
        if self.bench.continue_typing(event.character if event.is_printable else None):
            event.stop()
            event.prevent_default()
            return
        begins = (event.character or "") in tuple("=0123456789.")
        if begins and self.map.behavior_of_key(event.key) is None and event.key != self.map.default_key:
            event.stop()
            event.prevent_default()
            self.type_value((event.character or "").replace("=", ""))

    def on_click(self, event: events.Click) -> None:
        """Mark the row under the mouse; a second click takes it."""
        row = self.row_at(event)
        if row is None:
            return
        if row == self.marked and event.chain > 1:
            self.action_choose()
        self.mark(row)

    def row_at(self, event: events.MouseEvent) -> int | None:
        """Return the row under the mouse, if there is one."""
        offset = event.get_content_offset(self)
        if offset is None:
            return None
        row = offset.y - len(self.draw_head(self.content_size.width)) + self._first(self._room())
        return row if 0 <= row < self.count_rows() and offset.y < self.content_size.height else None

    def paint(self, width: int, height: int) -> list[Strip]:
        self.marked = max(0, min(self.marked, self.count_rows() - 1))
        head = self.draw_head(width)
        room = max(1, height - len(head))
        first = self._first(room)
        strips = list(head)
        for row in range(first, min(self.count_rows(), first + room)):
            marked = row == self.marked
            line = ScreenRow(width).add("▌" if marked else " ", STYLES.accent)
            self.draw_row(row, line, marked=marked)
            strips.append(line.strip())
        if (left := height - len(strips)) > 0:
            foot = self.draw_foot(width, left)[:left]
            strips += [Strip.blank(width)] * (left - len(foot)) + foot
        return strips

    def _room(self) -> int:
        return max(1, self.content_size.height - len(self.draw_head(self.content_size.width)))

    def _first(self, room: int) -> int:
        """Return the first row that is shown, so that the marked one is."""
        return max(0, min(self.marked - room // 2, self.count_rows() - room))


def draw_differences(
    differences: GhostDifferences,
    names: Sequence[str],
    units: Sequence[str],
    dt: float,
    width: int,
    lines: int,
) -> list[Strip]:
    """Return lines with the largest differences from the ghost, and over how long they are means."""
    means = differences.means()
    if means is None:
        return []
    strips = []
    row = ScreenRow(width).add(f"Δ over {differences.steps * dt:.1f} s", STYLES.ghost)
    for column in differences.ranked():
        said = f"  {names[column]} {format_signed(float(means[column]))} {units[column]}"
        if len(said) > row.left:
            strips.append(row.strip())
            if len(strips) == lines:
                return strips
            row = ScreenRow(width)
        row.add(said, STYLES.text)
    return [*strips, row.strip()][:lines]
