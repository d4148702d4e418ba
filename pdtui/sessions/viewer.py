"""The Rerun viewer, started on a file and bound to this machine only."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from pdtui.errors import SessionError

LOCAL = "127.0.0.1"


def viewer_command(path: Path, *, web: bool = False) -> list[str]:
    """The command that opens a session.

    Args:
        path: the session.
        web: serve it to a browser on this machine instead of opening a window.

    Raises:
        SessionError: the viewer is not installed, or there is no display for its window.
    """
    viewer = find_viewer()
    if not web and not _has_display():
        raise SessionError(
            "no display for the viewer's window (neither DISPLAY nor WAYLAND_DISPLAY is set); "
            "--web shows it in a browser"
        )
    command = [viewer, str(path.resolve()), "--bind", LOCAL]
    return [*command, "--serve-web"] if web else command


def find_viewer() -> str:
    """Beside this interpreter first: that viewer has the version that wrote the files."""
    beside = shutil.which("rerun", path=str(Path(sys.executable).parent))
    found = beside or shutil.which("rerun")
    if found is None:
        raise SessionError("no program 'rerun' was found; `pip install rerun-sdk` brings it")
    return found


def _has_display() -> bool:
    if sys.platform != "linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
