"""A worker process for which nobody waits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from pdtui.core.closable import Closable
from pdtui.core.errors import PdtuiError, format_error_in_one_line
from pdtui.core.processes.worker_pool import WorkerProcess


class BackgroundWorker(Closable):
    """Has a worker process do one piece of work at a time; a thread talks to it.

    The first piece of work starts the process, which is kept for later ones.

    Args:
        name: what the process works on, for error messages.
        build: function of a module that returns the state of the process; called there.
        arguments: arguments of `build`.
    """

    def __init__(self, name: str, build: Callable[..., object], *arguments: Any) -> None:
        self._name, self._build, self._arguments = name, build, arguments
        self._worker: WorkerProcess | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    @property
    def is_busy(self) -> bool:
        """Whether a piece of work is under way."""
        return self._thread is not None and self._thread.is_alive()

    def submit(self, work: Callable[[WorkerProcess], None], note_failure: Callable[[str], None]) -> None:
        """Begin a piece of work.

        Args:
            work: called in the thread, with the process.
            note_failure: called in the thread with one line on why the work failed.
        """
        self._thread = threading.Thread(target=self._guard, args=(work, note_failure), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Kill the process."""
        self._closed = True
        if self._worker is not None:
            self._worker.process.kill()

    def _guard(self, work: Callable[[WorkerProcess], None], note_failure: Callable[[str], None]) -> None:
        try:
            if self._worker is None:
                self._worker = WorkerProcess(self._name, self._build, *self._arguments)
            if self._closed:
                self._worker.process.kill()
            work(self._worker)
        except Exception as error:
            self._worker = None
            if not self._closed:
                is_own = isinstance(error, PdtuiError)
                note_failure(str(error) if is_own else format_error_in_one_line(error))
