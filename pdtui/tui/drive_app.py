"""The application that shows a running drive and passes keys on to it."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Mapping
from typing import cast

from textual import events
from textual.app import ComposeResult
from textual.containers import Container
from textual.reactive import reactive
from textual.widget import Widget

from pdtui.core.errors import PdtuiError
from pdtui.driving.drive_client import DriveConnection
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.pacer import PaceRequest
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import displayed_key_name
from pdtui.tui.commands.key_bound_app import HINTS, NO_KEYMAP, KeyBoundApp
from pdtui.tui.graphics.graphics_pane import GraphicsPane
from pdtui.tui.graphics.terminal_graphics import TerminalGraphics
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.spectra.spectra_pane import SpectraPane
from pdtui.tui.strip.unit_picked import UnitPicked
from pdtui.tui.style_sheets import DRIVE, HEIGHTS, WIDTHS
from pdtui.tui.terminal_size_notice import LEAST_SIZE, TerminalSizeNotice
from pdtui.tui.theme import THEME
from pdtui.tui.timeline.timeline_bar import TimelineBar, describe_past_keys
from pdtui.tui.unit_bench.bench_page import GainTuner
from pdtui.tui.unit_bench.bench_pane import BenchPane, BenchRequest
from pdtui.tui.widgets.activation_heatmap import ActivationHeatmap
from pdtui.tui.widgets.attribute_table import AttributeTable
from pdtui.tui.widgets.behavior_list import BehaviorList
from pdtui.tui.widgets.path_view import PathView
from pdtui.tui.widgets.robot_view import RobotView
from pdtui.tui.widgets.status_lines import KeyLine, NoticeLine, StatusLine
from pdtui.tui.widgets.unit_table import UnitTable
from pdtui.tui.widgets.world_picture import WorldPicture

_ENDING_SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class DriveApp(KeyBoundApp):
    """Shows the newest snapshot of a drive and passes keys on to it.

    The caller closes the connection afterwards. `run` returns None when the user quits; where the drive's
    process fails, it returns the failure's message and `return_code` is 1.

    Args:
        connection: the drive.
        stimulation_map: the behaviors that the drive was started with.
        fps: polls of the connection per second.
        watching: whether the drive follows a recording, so that keys that would change it are refused.
        theme: name of the theme.
        keymap: the user's keys, by the bindings' ids.
        tuning: tunes gains beside the drive; None where nothing can.
        graphics: how the terminal shows pictures; None for half blocks.
    """

    CSS = DRIVE
    TITLE = "pdtui"
    HORIZONTAL_BREAKPOINTS = WIDTHS
    VERTICAL_BREAKPOINTS = HEIGHTS

    facts: reactive[DriveFacts | None] = reactive(None, init=False, repaint=False, always_update=True)
    snapshot: reactive[DriveSnapshot | None] = reactive(None, init=False, repaint=False, always_update=True)

    def __init__(
        self,
        connection: DriveConnection,
        stimulation_map: StimulationMap,
        *,
        fps: int = 12,
        watching: bool = False,
        theme: str = THEME.name,
        keymap: Mapping[str, str] = NO_KEYMAP,
        tuning: GainTuner | None = None,
        graphics: TerminalGraphics | None = None,
    ) -> None:
        super().__init__(stimulation_map, theme, keymap)
        self.connection, self.fps, self.watching = connection, fps, watching
        self._keymap_at_first, self._graphics, self._could_go_back = keymap, graphics, False
        self._spectra = SpectraPane(self.map, connection, id="spectra")
        self._timeline = TimelineBar(self.map, connection, id="timeline")
        self._bench = BenchPane(self.map, self.action_run_key, connection.search_units, self.say, tuning)

    def compose(self) -> ComposeResult:
        def bound(panel: SnapshotWidget | GraphicsPane) -> Widget:
            return panel.data_bind(DriveApp.facts, DriveApp.snapshot)

        yield bound(StatusLine(self.map, id="status"))
        with Container(id="body"):
            with Container(id="left"):
                yield bound(RobotView(self.map, id="robot"))
                world = GraphicsPane(self._graphics, id="world") if self._graphics else None
                yield bound(world or WorldPicture(self.map, id="world"))
                with Container(id="below"):
                    yield bound(PathView(self.map, id="path"))
                    yield bound(UnitTable(self.map, id="units"))
                yield bound(self._spectra)
            with Container(id="right"):
                yield self._bench.data_bind(DriveApp.facts, DriveApp.snapshot)
                yield bound(BehaviorList(self.map, id="behaviors"))
                yield bound(AttributeTable(self.map, id="attributes"))
        yield bound(ActivationHeatmap(self.map, id="heat"))
        yield bound(self._timeline)
        yield bound(NoticeLine(self.map, id="notice")).data_bind(DriveApp.notice)
        yield KeyLine(self.map, id="keys")
        yield TerminalSizeNotice(id="too-small")

    def on_mount(self) -> None:
        self.query_one(StatusLine).watching = self.watching
        self._show_keys()
        self.set_interval(1.0 / self.fps, self._poll)
        self.say(self.describe_hidden_keys(self._keymap_at_first))
        loop = asyncio.get_running_loop()
        for number in _ENDING_SIGNALS:  # which would leave the terminal raw and the recording unfinished
            loop.add_signal_handler(number, self._end, number)

    def watch_facts(self, facts: DriveFacts | None) -> None:
        """Leave out the robot's picture for a world without links, and show the keys that the robot has."""
        bodiless, pictured = (False, False) if facts is None else (not facts.links, facts.pictured)
        self.screen_stack[0].set_class(bodiless, "-bodiless").set_class(pictured, "-pictured")
        self._show_keys()
        if facts is not None and facts.branches:  # the drive has left the recording
            self.query_one(StatusLine).watching = self.watching = False

    def _show_way_back(self) -> None:
        """Show the key that goes back while there is something to go back from."""
        if (can := bool(self._open_panes())) != self._could_go_back:
            self._could_go_back = can
            self._show_keys()

    def _open_panes(self) -> list[BenchPane | SpectraPane | TimelineBar]:
        """Return what the key that goes back leaves, in this order."""
        return [pane for pane in (self._bench, self._spectra, self._timeline) if pane.is_open]

    def _end(self, number: signal.Signals) -> None:
        self.exit(f"ended by {number.name}", return_code=1)

    def on_resize(self, event: events.Resize) -> None:
        too_small = event.size.width < LEAST_SIZE.width or event.size.height < LEAST_SIZE.height
        self.screen_stack[0].set_class(too_small, "-too-small")

    def set_keymap(self, keymap: Mapping[str, str]) -> None:
        """Bind other keys, by the bindings' ids in `pdtui.core.reserved_keys`."""
        super().set_keymap(dict(keymap))
        if self.is_running:
            self._show_keys()
            self.forget_help()

    def has_binding(self, name: str) -> bool:
        return name != "takeover" or (self.facts is not None and bool(self.facts.manual_controls))

    def _show_keys(self) -> None:
        now = self.keys_now
        hints = ((name, says) for name, says in HINTS.items() if name != "back" or self._could_go_back)
        shown = tuple((now[name][0], says) for name, says in hints if name in now)
        self.screen_stack[0].query_one(KeyLine).keys = shown
        notices = self.screen_stack[0].query_one(NoticeLine)
        notices.hints, notices.past_hints = f"{self.leaving_key} quits", describe_past_keys(now)

    def _poll(self) -> None:
        self.drop_old_notice()
        self._show_way_back()
        try:
            message = self.connection.poll_message()
        except PdtuiError as error:
            self.exit(str(error), return_code=1)
            return
        if isinstance(message, DriveFacts):
            self.facts = message
        elif message is not None:
            if message.notice:
                self.say(message.notice)
            self.snapshot = message

    def on_key(self, event: events.Key) -> None:
        """Give the map's keys precedence over all bindings, and name a key that is not bound."""
        if self.choosing_command:
            return
        if self._bench.takes_key(event.key):
            event.prevent_default()
        elif event.key in self.map_keys:
            event.prevent_default()
            self.action_run_key(event.key)
        elif not self.screen.is_modal and event.key not in self.screen.active_bindings:
            self.say(f"no behavior has the key {displayed_key_name(event.key)}; ? lists all keys")

    def action_run_key(self, key: str) -> None:
        """Send a key that changes the run, unless a recording is being watched."""
        if self._timeline.takes_key(key):
            return
        if self.watching:
            self.say(f"{displayed_key_name(key)}: this drive follows a recording, so keys cannot change it")
        elif self.snapshot is not None and self.snapshot.finished:
            self.say("the drive is over")
        elif self.facts is None:
            self.say("the policy is still loading")
        else:
            self.connection.press_key(key)
            self.query_one(BehaviorList).echo(key)

    def action_pace(self, request: str) -> None:
        """Change the drive's pace."""
        self.connection.change_pace(cast(PaceRequest, request))

    def action_pane(self, pane: str, request: str) -> None:
        """Have a pane do what its key asks for."""
        cast(SnapshotWidget, self.query_one(f"#{pane}")).handle_request(request)

    def action_go_back(self) -> None:
        """Leave what was opened; as this key is also pressed by mistake, it never ends the drive."""
        opened = self._open_panes()
        if opened:
            opened[0].leave()
        else:
            self.say(f"nothing is open; {self.leaving_key} ends the drive")

    def action_toggle_ghost(self) -> None:
        """Turn the ghost on or off; it is no part of the run, so it may run beside a recording, too."""
        if self.facts is None:
            self.say("the policy is still loading")
        else:
            self.connection.toggle_ghost()

    def action_bench(self, request: BenchRequest) -> None:
        """Open or close the unit bench, or show other layers."""
        self._bench.act(request)

    def on_unit_picked(self, event: UnitPicked) -> None:
        self._bench.pick(event.unit)

    def action_zoom_path(self, change: int) -> None:
        """Show more of the path for 1, less for −1."""
        self.query_one(PathView).zoom(change)

    def action_toggle_view(self) -> None:
        """Look at the robot from the side or from above."""
        self.query_one(RobotView).toggle_view()

    def action_leave(self) -> None:
        """Quit; the caller of `run` then ends the drive."""
        self.exit()
