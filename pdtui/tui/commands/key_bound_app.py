"""The part of the drive's application that gives keys, clicks and the command palette their meaning."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

from textual._context import active_message_pump
from textual.binding import Binding
from textual.command import CommandPalette
from textual.message_pump import MessagePump
from textual.worker import WorkerFailed, get_current_worker

from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.core.settings.settings_file import ALWAYS_QUITS
from pdtui.tui.cell_text import displayed_key_name
from pdtui.tui.commands.key_clicked import KeyClicked
from pdtui.tui.commands.palette_commands import PaletteProvider
from pdtui.tui.themes.themed_app import ThemedApp

# A key that changes the run goes to the drive under its original name, whatever key the user gave it.
# Each binding has an id, so that users can remap it.
BINDINGS: list[Binding] = [
    *(Binding(row.key, row.action or f"run_key('{row.key}')", row.says, id=row.id) for row in KEY_TABLE),
    Binding(ALWAYS_QUITS, "leave", "ends the drive and quits, always", id="quit_always", priority=True),
]
HINTS = {row.id: row.hint for row in sorted(KEY_TABLE, key=lambda row: row.hint_rank) if row.hint}
"""Words of the key line by the bindings' ids, the most useful first."""
NO_KEYMAP: Mapping[str, str] = {}


class KeyBoundApp(ThemedApp[str], inherit_bindings=False):
    """Has the bindings of the key table, as the user has remapped them.

    Textual's own keys are left out: with its ctrl+q, which resumes output on many terminals, it would quit.

    Args:
        map_keys: keys of the map, which come before the application's own.
        theme: name of the theme.
        keymap: the user's keys, by the bindings' ids.
    """

    BINDINGS = BINDINGS  # type: ignore[assignment]  # Textual's own type is an invariant list of a union
    ENABLE_COMMAND_PALETTE = True
    COMMANDS = {PaletteProvider}  # noqa: RUF012 - Textual's own type is not one of a class

    def __init__(self, map_keys: set[str], theme: str, keymap: Mapping[str, str]) -> None:
        super().__init__(theme)
        self.map_keys = map_keys
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

    def has_binding(self, name: str) -> bool:
        """Return whether a binding means anything for this robot."""
        del name
        return True

    def action_command_palette(self) -> None:
        """Open the command palette; without an id, since the one before may still be closing."""
        if not CommandPalette.is_open(self):
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

    def say(self, notice: str) -> None:
        """Show a notice for a few seconds."""
        raise NotImplementedError
