"""Run the Rerun viewer so that it ends with this process, whatever ends this process.

The program `rerun` is a script that starts the viewer itself, so the death of the script would leave the
viewer running. A small process in between, which is this file run by itself, has both in its process group,
and the reading end of a pipe that closes when pdtui ends, even by SIGKILL, and then ends the whole group.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress

CANNOT_START = 127
"""Exit code for a viewer that cannot be started, as of a shell."""


def run_viewer(command: Sequence[str]) -> int:
    """Run a viewer until the user closes it, and return its exit code, 128 + n if signal n ended it.

    The code is `CANNOT_START` if it cannot be started. An exception, such as that of Ctrl-C, ends the viewer.
    """
    # Without the user's paths and packages, which the process in between does not need, it starts at once.
    watching = [sys.executable, "-I", "-S", __file__, *command]
    with subprocess.Popen(watching, stdin=subprocess.PIPE, start_new_session=True) as watcher:
        try:
            return watcher.wait()
        finally:
            if watcher.returncode != 0:
                _end_group(watcher.pid)


def _end_group(group: int) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(group, signal.SIGKILL)


def _watch(command: Sequence[str]) -> int:
    """Run a viewer in this process's group until it ends or standard input closes."""
    try:
        viewer = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    except OSError:
        return CANNOT_START
    threading.Thread(target=_end_group_with_parent, daemon=True).start()
    code = viewer.wait()
    return code if code >= 0 else 128 - code


def _end_group_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)
    _end_group(os.getpgrp())


if __name__ == "__main__":
    sys.exit(_watch(sys.argv[1:]))
