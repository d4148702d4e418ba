"""The unit bench: a pane with pages for units, the stack of behaviors, controllers and a search."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import ClassVar, Literal

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.reactive import reactive

from pdtui.core.drive_edits import write_edit
from pdtui.core.errors import PdtuiError
from pdtui.core.units import format_unit
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.unit_bench.unit_search_snapshot import UnitSearchRequest
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.unit_bench.bench_entry import Answer, BenchEntry
from pdtui.tui.unit_bench.bench_page import BenchPage, GainTuner
from pdtui.tui.unit_bench.bench_saving import (
    build_bench_behavior,
    check_behavior_key,
    check_behavior_name,
    describe_measurement,
    save_behavior,
)
from pdtui.tui.unit_bench.ghost_differences import GhostDifferences
from pdtui.tui.unit_bench.pid_page import PidPage
from pdtui.tui.unit_bench.search_page import SearchPage
from pdtui.tui.unit_bench.stack_page import StackPage
from pdtui.tui.unit_bench.unit_page import UnitPage
from pdtui.tui.widgets.activation_heatmap import ActivationHeatmap

BenchRequest = Literal["toggle", "next layer", "layer before"]
_PAGES: tuple[type[BenchPage], ...] = (UnitPage, StackPage, PidPage, SearchPage)


class BenchPane(Vertical):
    """The pane, one of whose pages is shown, and a line in which values, names and keys are typed.

    Args:
        stimulation_map: the behaviors of the drive.
        send: sends an edit to the drive.
        find_units: begins a search for units.
        say: shows a notice.
        tuning: tunes gains; None where nothing can.
    """

    BINDINGS: ClassVar = [
        Binding("tab", "turn(1)", "the next page", id="bench_next"),
        Binding("shift+tab", "turn(-1)", "the page before", id="bench_previous"),
        Binding("ctrl+s", "save", "saves the held units, or gains, into the map", id="bench_save"),
    ]
    facts: reactive[DriveFacts | None] = reactive(None, init=False, repaint=False, always_update=True)
    snapshot: reactive[DriveSnapshot | None] = reactive(None, init=False, repaint=False, always_update=True)

    def __init__(
        self,
        stimulation_map: StimulationMap,
        send: Callable[[str], None],
        find_units: Callable[[UnitSearchRequest], None],
        say: Callable[[str], None],
        tuning: GainTuner | None = None,
    ) -> None:
        super().__init__(id="bench", disabled=True)  # so that none of it gets the keys while it is closed
        self.map = self.target = stimulation_map
        self.send, self.find_units, self.say, self.tuning = send, find_units, say, tuning
        self.differences = GhostDifferences()
        self.pages = [page(stimulation_map, self, id=f"bench-{page.TAB}") for page in _PAGES]
        self._page = 0
        self._entry = BenchEntry(say, self._focus_page)
        self._saved_keys: dict[str, tuple[str, ...]] = {}
        self.is_open = False
        """Whether the pane is shown."""

    def compose(self) -> ComposeResult:
        for page in self.pages:
            yield page.data_bind(BenchPane.facts, BenchPane.snapshot)
        yield self._entry

    def on_mount(self) -> None:
        self._show_page()

    def watch_snapshot(self, snapshot: DriveSnapshot | None) -> None:
        if snapshot is not None and self.facts is not None:
            self.differences.add(snapshot, self.facts.attributes)

    def act(self, request: BenchRequest) -> None:
        """Open or close the pane, or show other layers of the strip."""
        if request == "toggle":
            if self.is_open:
                self.leave()
            else:
                self.open()
        elif not self._walk_layers(1 if request == "next layer" else -1):
            change = 1 if request == "next layer" else -1
            self.screen.query_one(ActivationHeatmap).scroll_layers(change)

    def open(self) -> None:
        """Show the pane and give it the keys."""
        self.disabled, self.is_open = False, True
        self.screen.add_class("-bench")
        self._focus_page()
        self.pages[self._page].row_was_marked()

    def leave(self) -> None:
        """Close the pane."""
        if self._entry.display:
            self._entry.action_leave()
        self.screen.remove_class("-bench")
        self.screen.set_focus(None)
        self.disabled, self.is_open = True, False
        self.point_to(-1)

    def action_turn(self, direction: int) -> None:
        """Show the next page, or the one before for −1."""
        self._page = (self._page + direction) % len(self.pages)
        self._show_page()
        if not self._entry.display:
            self.open()

    def pick(self, unit: int) -> None:
        """Open the bench with the row of a unit."""
        self._page = 0
        self._show_page()
        self.open()
        page = self.pages[0]
        assert isinstance(page, UnitPage)
        page.pick(unit)

    def _walk_layers(self, change: int) -> bool:
        page = self.pages[self._page]
        if not (self.is_open and isinstance(page, UnitPage)):
            return False
        page.walk_layers(change)
        return True

    def takes_key(self, key: str) -> bool:
        """Hold the units of a behavior that was saved in this drive, if it has this key."""
        for edit in self._saved_keys.get(key, ()):
            self.send(edit)
        return key in self._saved_keys

    def point_to(self, unit: int) -> None:
        """Mark a unit in the strip; −1 for none."""
        self.screen.query_one(ActivationHeatmap).point_to(unit)

    def ask(self, what: str, before: str, answer: Answer) -> None:
        """Let the user type something, as `BenchEntry.ask` does."""
        self._entry.ask(what, before, answer)

    def continue_typing(self, character: str | None) -> bool:
        """Add a character to the line in which something is typed, if there is one and there is a line."""
        if character is None or not self._entry.display:
            return False
        self._entry.insert_text_at_cursor(character)
        return True

    def ask_number(self, what: str, before: str, take: Callable[[float], None]) -> None:
        """Let the user type a number, as `BenchEntry.ask_number` does."""
        self._entry.ask_number(what, before, take)

    def action_save(self) -> None:
        """Save what the page edits, or ask for a name and a key for a behavior that holds the units."""
        if self.pages[self._page].save():
            return
        held = self._held()
        if not held:
            self.say("no unit is held that could be saved")
            return

        def ask_key(name: str) -> str:
            if wrong := check_behavior_name(self.target, name):
                return wrong
            self.ask(f"key of '{name}'", "", lambda key: self._save(name, key, held))
            return ""

        self.ask("name of a behavior for the held units", "", ask_key)

    def _save(self, name: str, key: str, held: Mapping[int, float]) -> str:
        if wrong := check_behavior_key(self.target, key):
            return wrong
        assert self.facts is not None
        measured = describe_measurement(self.facts, self.differences)
        behavior = build_bench_behavior(name, key, held, self.facts.layers, measured.aim)
        try:
            path = save_behavior(self.target, self.facts, behavior, measured.comments)
        except PdtuiError as error:
            return str(error)
        behaviors = {**self.target.behaviors, name: behavior}
        self.target = replace(self.target, source=str(path), behaviors=behaviors)
        self._saved_keys[key] = tuple(
            write_edit("unit", format_unit(unit, self.facts.layers), value) for unit, value in held.items()
        )
        self.say(f"'{name}' is in {path}; until the next drive, {key} holds its units")
        return ""

    def _held(self) -> dict[int, float]:
        page = self.pages[0]
        assert isinstance(page, UnitPage)
        return page.units.held()

    def _focus_page(self) -> None:
        self.screen.set_focus(self.pages[self._page])  # at once, as further keys may be on their way

    def _show_page(self) -> None:
        for number, page in enumerate(self.pages):
            page.display = number == self._page
        tabs = [
            f"[reverse] {page.TAB} [/]" if number == self._page else f" {page.TAB} "
            for number, page in enumerate(self.pages)
        ]
        self.border_title = "".join(tabs)
        self.border_subtitle = self.pages[self._page].KEYS

    def on_click(self, event: events.Click) -> None:
        """Turn to the page whose name in the frame was clicked."""
        offset = event.get_content_offset(self)
        if offset is not None or event.y != 0:
            return
        end = 2
        for number, page in enumerate(self.pages):
            end += len(page.TAB) + 2
            if event.x < end:
                self._page = number
                self._show_page()
                self.open()
                return
