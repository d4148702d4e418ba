"""Shows a recording in the viewer's own window, or in the browser."""

from __future__ import annotations

from pathlib import Path

from pdtui.core.errors import SessionError
from pdtui.sessions.viewer.viewer_address import viewer_command_line
from pdtui.sessions.viewer.viewer_process import CANNOT_START, run_viewer


def show_in_viewer(path: Path, *, web: bool = False) -> None:
    """Run the viewer with a recording until the user closes it.

    Raises:
        SessionError: The viewer is not installed, cannot be started, has no display, or has failed.
    """
    code = run_viewer(viewer_command_line(path, web=web))
    if code:
        how = "cannot be started" if code == CANNOT_START else f"ended with code {code}"
        raise SessionError(f"{path}: the viewer {how}")
