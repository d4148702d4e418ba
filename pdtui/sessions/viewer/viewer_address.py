"""Find or start the Rerun viewer; a viewer that is started listens on this machine only."""

from __future__ import annotations

import os
import re
import shutil
import socket
import sys
from dataclasses import dataclass
from pathlib import Path

from pdtui.core.errors import SessionError

LOCAL = "127.0.0.1"
PORT = 9876
_PROBE_SECONDS = 0.5


@dataclass(frozen=True)
class ViewerAddress:
    """The address on which a viewer listens."""

    host: str = LOCAL
    port: int = PORT

    @classmethod
    def parse(cls, text: str) -> ViewerAddress:
        """Parse ``PORT``, ``HOST`` or ``HOST:PORT``; the defaults are 127.0.0.1 and 9876.

        Text that has none of these forms is a `SessionError`.
        """
        match = re.fullmatch(
            r"(?:(?P<host>[A-Za-z][\w.-]*|\d+(?:\.\d+){3})(?::(?=\d)|$))?(?P<port>\d{1,5})?", text
        )
        port = PORT if match is None or match["port"] is None else int(match["port"])
        if match is None or not text or not 0 < port < 65536:
            raise SessionError(f"viewer '{text}': expected PORT, HOST or HOST:PORT, such as 9876")
        return cls(match["host"] or LOCAL, port)

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"

    @property
    def is_listening(self) -> bool:
        """Whether a viewer listens there. Ask before connecting: the library would wait for seconds."""
        try:
            socket.create_connection((self.host, self.port), _PROBE_SECONDS).close()
        except OSError:
            return False
        return True

    @property
    def absence_message(self) -> str:
        """The message for an address on which no viewer listens; it says what to do."""
        start = f"`rerun --bind {LOCAL} --port {self.port}`" if self.host == LOCAL else "a viewer there"
        return f"no viewer listens on {self}: start {start}, then drive again with --viewer"


def viewer_command_line(path: Path, *, web: bool = False) -> list[str]:
    """Return the command that opens a session in the viewer's window, or serves it to a local browser.

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
    """Return the path of the viewer, preferably that beside this interpreter, which has the right version."""
    beside = shutil.which("rerun", path=str(Path(sys.executable).parent))
    found = beside or shutil.which("rerun")
    if found is None:
        raise SessionError("the program 'rerun' was not found; `pip install rerun-sdk` installs it")
    return found


def _has_display() -> bool:
    if sys.platform != "linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
