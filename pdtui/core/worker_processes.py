"""Worker processes: they end with the process that started them."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading


def obey_parent() -> None:
    """Called first in a worker process: it ends when its parent ends, and leaves Ctrl-C to it."""
    # Ctrl-C reaches the whole process group; only the parent answers it, or every worker prints a traceback.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A parent that is killed, or whose terminal closes, tells nobody: without this its workers stay."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)
