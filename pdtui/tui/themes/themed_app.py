"""The base of pdtui's applications: themes, and the link to the terminal."""

from __future__ import annotations

from functools import cache
from typing import TypeVar

from textual import constants
from textual.app import App
from textual.await_complete import AwaitComplete
from textual.theme import BUILTIN_THEMES, Theme

from pdtui.core.errors import SettingsError
from pdtui.tui.browser.browser_driver import BrowserDriver
from pdtui.tui.terminal_driver import TerminalDriver
from pdtui.tui.theme import STYLES, THEME

Result = TypeVar("Result")


@cache
def list_themes() -> dict[str, Theme]:
    """Return pdtui's own theme and those of Textual, by their names.

    Those whose colors are the terminal's own are left out: nothing can be drawn between two colors that
    are not known.
    """
    return {THEME.name: THEME, **{name: theme for name, theme in BUILTIN_THEMES.items() if not theme.ansi}}


def require_theme(name: str, where: str) -> str:
    """Return the name of a theme; a `SettingsError` that begins with `where` lists what there is."""
    if name not in list_themes():
        raise SettingsError(f"{where}: no theme '{name}'; available: {', '.join(list_themes())}")
    return name


class ThemedApp(App[Result]):
    """An application with a theme, whose driver survives whatever a terminal sends.

    Args:
        theme: name of the theme.
    """

    def __init__(self, theme: str = THEME.name) -> None:
        # The environment names a driver where the screen is a page in a browser.
        super().__init__(driver_class=BrowserDriver if constants.DRIVER else TerminalDriver)
        self.register_theme(THEME)
        self.theme = require_theme(theme, "theme")
        STYLES.adopt(list_themes()[theme])

    @property
    def available_themes(self) -> dict[str, Theme]:
        return dict(list_themes())

    def pop_screen(self) -> AwaitComplete:
        """Close the screen on top; the last one stays.

        Two quick keys or clicks may both close the command palette, the second one when it is gone already.
        """
        return super().pop_screen() if len(self.screen_stack) > 1 else AwaitComplete()

    def watch_theme(self, name: str) -> None:
        """Paint with the colors of a theme that was chosen while the application runs."""
        STYLES.adopt(list_themes()[name])
