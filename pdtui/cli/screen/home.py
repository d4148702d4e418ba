"""`pdtui` without a command: the home screen, to which everything that it opens leads back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pdtui.cli.options.shared_options import build_drive_config
from pdtui.cli.screen.session_names import record_into_new_session
from pdtui.cli.screen.show_drive import require_settled_theme, require_terminal, run_drive_screen
from pdtui.core.errors import PdtuiError
from pdtui.core.settings.settings_file import read_settings

if TYPE_CHECKING:
    from pdtui.core.settings.user_settings import UserSettings
    from pdtui.tui.home.home_rows import HomeRow


def show_home() -> None:
    """Show the home screen, open what is chosen, and show it again, until the user leaves it."""
    require_terminal()
    settings = read_settings()
    require_settled_theme(settings)
    from pdtui.driving.drive_client import prepare_simulation

    prepare_simulation()  # meanwhile, the user chooses
    from pdtui.tui.home.home_app import HomeApp
    from pdtui.tui.home.home_contents import read_home_contents

    notice = ""
    while (chosen := HomeApp(read_home_contents(), settings.theme, notice).run()) is not None:
        try:
            notice = _open_row(chosen, settings)
        except PdtuiError as error:
            notice = str(error)


def _open_row(row: HomeRow, settings: UserSettings) -> str:
    """Open what a row stands for, wait until it ends, and return one line on how it ended."""
    match row.opens:
        case "drive":
            config = build_drive_config(row.path, None, "", start=row.start)
            return run_drive_screen(record_into_new_session(config), settings)
        case "watch":
            from pdtui.driving.session_replay import config_from_session
            from pdtui.sessions.session_header import read_session_header

            recorded = read_session_header(Path(row.path))
            return run_drive_screen(config_from_session(recorded, row.path, ""), settings, watching=True)
        case "viewer":
            from pdtui.sessions.viewer.viewer_window import show_in_viewer

            show_in_viewer(Path(row.path))
        case "guide":
            from pdtui.guide.guide_pages import read_guide
            from pdtui.tui.guide.guide_app import GuideApp

            GuideApp(read_guide(), "index", settings.theme).run()
    return ""
