"""The part of the drive's application that gives keys, clicks and the command palette their meaning."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from time import monotonic
from typing import cast

from textual._context import active_message_pump
from textual.app import App
from textual.binding import Binding
from textual.command import CommandPalette
from textual.message_pump import MessagePump
from textual.reactive import reactive
from textual.worker import WorkerFailed, get_current_worker

from pdtui.core.errors import PdtuiError
from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.core.settings.settings_file import ALWAYS_QUITS
from pdtui.core.settings.settings_writer import save_setting
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import displayed_key_name
from pdtui.tui.commands.key_clicked import KeyClicked
from pdtui.tui.commands.palette_commands import PaletteProvider
from pdtui.tui.help_screen import HelpScreen
from pdtui.tui.themes.themed_app import ThemedApp

# A key that changes the run goes to the drive under its original name, whatever key the user gave it.
# Each binding has an id, so that users can remap it.
BINDINGS: list[Binding] = [
    *(Binding(row.key, row.action or f"run_key('{row.key}')", row.says, id=row.id) for row in KEY_TABLE),
    Binding(ALWAYS_QUITS, "leave", "ends the drive and quits, always", id="quit_always", priority=True),
]
NOTICE_SECONDS = 4.0
HINTS = {row.id: row.hint for row in sorted(KEY_TABLE, key=lambda row: row.hint_rank) if row.hint}
"""Words of the key line by the bindings' ids, the most useful first."""
NO_KEYMAP: Mapping[str, str] = {}


class KeyBoundApp(ThemedApp[str], inherit_bindings=False):
    """Has the bindings of the key table, as the user has remapped them.

    Textual's own keys are left out: with its ctrl+q, which resumes output on many terminals, it would quit.

    Args:
        stimulation_map: the behaviors, whose keys come before the application's own.
        theme: name of the theme.
        keymap: the user's keys, by the bindings' ids.
    """

    BINDINGS = BINDINGS  # type: ignore[assignment]  # Textual's own type is an invariant list of a union
    ENABLE_COMMAND_PALETTE = True
    notice: reactive[str] = reactive("", init=False, repaint=False)
    COMMANDS = {PaletteProvider}  # noqa: RUF012 - Textual's own type is not one of a class

    def __init__(self, stimulation_map: StimulationMap, theme: str, keymap: Mapping[str, str]) -> None:
        super().__init__(theme)
        self.map, behaviors = stimulation_map, stimulation_map.behaviors.values()
        self.map_keys = {stimulation_map.default_key, *(behavior.key for behavior in behaviors)}
        self._help: HelpScreen | None = None
        self._notice_until = 0.0
        if keymap:
            self.set_keymap(keymap)

    def describe_hidden_keys(self, keymap: Mapping[str, str]) -> str:
        """Return which of the user's keys the map has for a behavior; empty if none."""
        hidden = [
            f"{displayed_key_name(key)} ({name})" for name, key in keymap.items() if key in self.map_keys
        ]
        return f"keys of your settings that the map has for itself: {', '.join(hidden)}" if hidden else ""

    @property
    def keys_now(self) -> dict[str, tuple[str, str]]:
        """Key and description of each binding by id, as remapped, unless map or robot leave it out."""
        found: dict[str, tuple[str, str]] = {}
        for key, active in self.screen_stack[0].active_bindings.items():
            binding = active.binding
            if active.node is self and binding.id and (binding.priority or key not in self.map_keys):
                found.setdefault(binding.id, (key, binding.description))
        return {
            name: found[name]
            for binding in BINDINGS
            if (name := binding.id) in found and self.has_binding(binding.id or "")
        }

    @property
    def leaving_key(self) -> str:
        """The key that ends the drive, as it is displayed."""
        now = self.keys_now
        return displayed_key_name(now.get("quit", now["quit_always"])[0])

    def watch_theme(self, name: str) -> None:
        super().watch_theme(name)
        if self.is_running:
            self.forget_help()

    def forget_help(self) -> None:
        """Have the help written anew, once it is not shown."""
        if self._help is not None and self._help is not self.screen:
            self.uninstall_screen("help")
            self._help = None

    def action_help(self) -> None:
        """Show the help."""
        if isinstance(self.screen, HelpScreen):
            return
        # Created only once: Textual caches what up to 1024 removed widgets have drawn.
        if self._help is None:
            self._help = HelpScreen(self.map, list(self.keys_now.values()))
            self.install_screen(self._help, "help")
        self.push_screen("help")

    def has_binding(self, name: str) -> bool:
        """Return whether a binding means anything for this robot."""
        del name
        return True

    def action_command_palette(self) -> None:
        """Open the command palette; without an id, since the one before may still be closing."""
        if not CommandPalette.is_open(cast("App[object]", self)):
            self.push_screen(CommandPalette())

    def _handle_exception(self, error: Exception) -> None:
        """End with the error, unless the palette failed: it only closes, and the drive goes on.

        Textual's palette raises when a click or a key reaches an entry or a list that has just gone.
        """
        failed: MessagePump | None = active_message_pump.get(None)
        if isinstance(error, WorkerFailed):
            failed = get_current_worker().node
        while failed is not None and not isinstance(failed, CommandPalette):
            failed = failed._parent
        if failed is None:
            super()._handle_exception(error)
        elif failed is self.screen:
            self.call_later(self.pop_screen)

    @property
    def choosing_command(self) -> bool:
        """Whether the command palette is open, so that keys belong to it."""
        return isinstance(self.screen, CommandPalette)

    def on_key_clicked(self, message: KeyClicked) -> None:
        """Do what the key does."""
        message.stop()
        self.simulate_key(message.key)

    def action_save_screen(self) -> None:
        """Write the screen as an SVG file into the working directory, once the palette is gone."""
        self.set_timer(0.1, self._save_screen)

    def _save_screen(self) -> None:
        name = f"pdtui-{datetime.now():%Y%m%d-%H%M%S}.svg"
        try:
            path = self.save_screenshot(name, path=".")
        except OSError as error:
            self.say(f"{name}: {error.strerror}")
        else:
            self.say(f"wrote {path}")

    def save_theme(self) -> None:
        """Write the present theme into the user's settings."""
        try:
            path = save_setting("theme", self.theme)
        except PdtuiError as error:
            self.say(str(error))
        else:
            self.say(f"theme {self.theme} is in {path}")

    def say(self, notice: str) -> None:
        """Show a notice for a few seconds."""
        self.notice = notice
        self._notice_until = monotonic() + NOTICE_SECONDS

    def drop_old_notice(self) -> None:
        """Show a notice no longer whose seconds are over."""
        if self._notice_until and monotonic() > self._notice_until:
            self._notice_until, self.notice = 0.0, ""
