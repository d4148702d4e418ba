"""The help overlay, which lists every key and what it does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from pdtui.core.printable_text import make_printable
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import displayed_key_name
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_keys import BENCH_KEYS

_LATCHING = (
    "A key latches its behavior, which stays active until its period ends, or until you press the key of "
    "another behavior or the key that clears all. Terminals do not report when a key is released."
)
KeyLines = Sequence[tuple[str, str]]


class HelpScreen(ModalScreen[None]):
    """Lists the keys of the map, then the application's keys as remapped; the drive goes on beneath."""

    BINDINGS: ClassVar = [
        Binding("question_mark,q,enter,escape", "dismiss", "closes the help", id="close_help"),
        Binding("up", "scroll(-1)", show=False, id="help_up"),
        Binding("down", "scroll(1)", show=False, id="help_down"),
    ]

    def __init__(self, stimulation_map: StimulationMap, keys: KeyLines) -> None:
        super().__init__()
        self._map, self._keys = stimulation_map, keys

    def compose(self) -> ComposeResult:
        with VerticalScroll(id="help", can_focus=False) as box:
            box.border_title = "keys"
            box.border_subtitle = "? q ↵ close   ↑ ↓ scroll"
            yield Static(self._text())

    def action_scroll(self, direction: int) -> None:
        """Scroll the list by a few lines."""
        self.query_one("#help").scroll_relative(y=3 * direction, animate=False)

    def _text(self) -> Text:
        text = Text(no_wrap=False)

        def line(key: str, says: str, cap: Style, style: Style) -> None:
            text.append(f" {displayed_key_name(key)} ", cap)
            text.append(" " * max(1, 9 - len(displayed_key_name(key))))
            text.append(f"{make_printable(says)}\n", style)

        text.append("behaviors\n", STYLES.accent)
        for row, behavior in enumerate(self._map.behaviors.values()):
            cap = STYLES.caps[row % len(STYLES.caps)]
            period = "" if behavior.period is None else f" ({behavior.period:g} s)"
            line(behavior.key, f"{behavior.name}: {behavior.says}{period}", cap, STYLES.text)
        line(self._map.default_key, "clears all stimulation", STYLES.key, STYLES.text)
        text.append(f"\n{_LATCHING}\n", STYLES.muted)
        text.append("\nother keys\n", STYLES.accent)
        for key, says in self._keys:
            line(key, says, STYLES.key, STYLES.text)
        text.append("\nwhile the unit bench is open\n", STYLES.accent)
        for key, says in BENCH_KEYS:
            line(key, says, STYLES.key, STYLES.text)
        return text
