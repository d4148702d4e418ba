"""Shows a drive on the screen."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from pdtui.cli.screen.drive_precheck import is_certain_to_start
from pdtui.core.errors import ScreenError
from pdtui.core.printable_text import make_printable
from pdtui.core.settings.settings_file import read_settings, settings_path
from pdtui.core.settings.user_settings import UserSettings

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig

BROWSER_VARIABLE = "TEXTUAL_DRIVER"
"""Set by whatever shows the screen without a terminal, which is how Textual knows it, too."""


def show_drive(config: DriveConfig, settings: UserSettings | None = None, *, watching: bool = False) -> None:
    """Drive on the screen, then print one line on how the drive ended."""
    require_terminal()
    from pdtui.driving.drive_client import prepare_simulation

    prepare_simulation(config.robot)  # what follows loads the screen
    settings = read_settings() if settings is None else settings
    require_settled_theme(settings)
    click.echo(make_printable(run_drive_screen(config, settings, watching=watching)))


def run_drive_screen(config: DriveConfig, settings: UserSettings, *, watching: bool = False) -> str:
    """Start the simulation's process, show it on the screen, and return one line on how the drive ended.

    Where robot, policy or recording may still be refused, the screen opens once the simulation has them.
    """
    from pdtui.driving.drive_client import DriveClient
    from pdtui.search.gains.gain_tuning_process import GainTuningProcess

    connection = DriveClient(config)
    tuning = GainTuningProcess(config)
    try:
        from pdtui.tui.drive_app import DriveApp
        from pdtui.tui.graphics.terminal_graphics import find_terminal_graphics

        if not is_certain_to_start(config):
            if not watching:
                click.echo(make_printable(f"starting {config.robot} …"), err=True)
            connection.wait_until_started()
        app = DriveApp(
            connection,
            config.stimulation_map,
            fps=settings.fps,
            watching=watching,
            theme=settings.theme,
            keymap=settings.keymap,
            tuning=tuning,
            graphics=find_terminal_graphics() if connection.is_pictured else None,
        )
        message = app.run()
    finally:
        tuning.close()
        last_words = connection.close()
    if app.return_code or connection.failed:
        said = message or last_words
        raise ScreenError(said if connection.recording in said else f"{said}; {last_words}")
    return last_words


def require_terminal() -> None:
    """Raise a `ScreenError` unless standard input and output are a terminal, or a browser is behind them."""
    if not has_screen():
        raise ScreenError("the screen needs a terminal; use --headless to drive without one")


def has_screen() -> bool:
    """Return whether there is a terminal, or a browser, whose output is then kept free of what is printed."""
    if BROWSER_VARIABLE in os.environ:
        from pdtui.tui.browser.browser_driver import BrowserDriver

        BrowserDriver.claim_output()
        return True
    return sys.stdin.isatty() and sys.stdout.isatty()


def require_settled_theme(settings: UserSettings) -> None:
    """Raise a `SettingsError` that says where it was named, unless there is such a theme."""
    from pdtui.tui.themes.themed_app import require_theme

    from_file = settings.theme == read_settings().theme
    require_theme(settings.theme, f"{settings_path()}: theme" if from_file else "--theme")
