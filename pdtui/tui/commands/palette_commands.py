"""What the command palette offers during a drive: behaviors, keys and themes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from textual.command import DiscoveryHit, Hit, Hits, Provider

from pdtui.core.printable_text import make_printable
from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.tui.cell_text import displayed_key_name
from pdtui.tui.themes.themed_app import list_themes

if TYPE_CHECKING:
    from pdtui.tui.drive_app import DriveApp


class PaletteCommand(NamedTuple):
    """A command: its name, what it does with its key, and the function that does it."""

    name: str
    says: str
    run: Any


def list_palette_commands(app: DriveApp) -> Iterator[PaletteCommand]:
    """Yield every command of a drive; keys that the robot does not have are left out."""
    for behavior in app.map.behaviors.values():
        name = make_printable(f"latch {behavior.name}")
        says = make_printable(f"{displayed_key_name(behavior.key)} · {behavior.says}")
        yield PaletteCommand(name, says, partial(app.action_run_key, behavior.key))
    key = app.map.default_key
    says = f"{displayed_key_name(key)} · the policy acts alone"
    yield PaletteCommand("clear all stimulation", says, partial(app.action_run_key, key))
    now = app.keys_now
    for row in KEY_TABLE:
        if row.id not in now or row.action == "command_palette":
            continue
        run = partial(app.run_action, row.action) if row.action else partial(app.action_run_key, row.key)
        yield PaletteCommand(
            row.id.replace("_", " "), f"{displayed_key_name(now[row.id][0])} · {row.says}", run
        )
    yield PaletteCommand("screenshot", "writes the screen as an SVG file", app.action_save_screen)
    for name, theme in list_themes().items():
        says = "dark, for this drive" if theme.dark else "light, for this drive"
        yield PaletteCommand(f"theme {name}", says, partial(setattr, app, "theme", name))
    yield PaletteCommand("save theme", f"keeps {app.theme} as the setting", app.save_theme)


class PaletteProvider(Provider):
    """Finds the commands of the drive that is on the screen."""

    @property
    def _commands(self) -> Iterator[PaletteCommand]:
        return list_palette_commands(cast("DriveApp", self.app))

    async def discover(self) -> Hits:
        for command in self._commands:
            yield DiscoveryHit(command.name, command.run, help=command.says)

    async def search(self, query: str) -> Hits:
        matcher = self.matcher(query)
        for command in self._commands:
            score = max(matcher.match(command.name), 0.5 * matcher.match(command.says))
            if score > 0.0:
                yield Hit(score, matcher.highlight(command.name), command.run, help=command.says)
