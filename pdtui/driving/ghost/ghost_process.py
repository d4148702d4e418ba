"""The process of the ghost, for which the drive never waits."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from pdtui.core.closable import Closable
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import PdtuiError, WorkerError, format_error_in_one_line
from pdtui.core.processes.worker_pool import WorkerProcess, describe_exit
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_simulation import (
    GhostStart,
    GhostStepInput,
    GhostStepResult,
    answer_when_loaded,
    build_ghost_loop,
    run_ghost,
)

_STEPS_PER_CALL = 10  # control steps; a ghost that has fallen behind still hears soon of a new start


class GhostProcess(Closable):
    """Runs a ghost in a worker process.

    No method waits: a thread talks to the process, which may be loading, slow, stopped or dead.

    Args:
        config: the drive.
    """

    def __init__(self, config: DriveConfig) -> None:
        config = config if config.ghost is None else config.ghost.configure(config)
        self._config = replace(config, recording="", viewer=None, watched=None, ghost=None)
        self._changed = threading.Condition()
        self._worker: WorkerProcess | None = None
        self._start: GhostStart | None = None
        self._tasks: deque[GhostStepInput] = deque()
        self._steps: list[GhostStepResult] = []
        self._over = False  # the episode of the present ghost has ended
        self._number = 0  # of the present ghost, so that steps of an earlier one are dropped
        self._closed = False
        self.loaded = False
        """Whether robot and policy are loaded."""
        self.failure = ""
        """Why the process can run no ghost; empty while it can."""
        threading.Thread(target=self._talk, name="pdtui ghost", daemon=True).start()

    @property
    def pid(self) -> int:
        """Process id; 0 before the process has started."""
        worker = self._worker
        return 0 if worker is None else worker.process.pid or 0

    def start(self, start: GhostStart | None) -> None:
        """Begin a ghost in the place of the present one, or only end that if `start` is None."""
        with self._changed:
            self._start, self._tasks, self._steps = start, deque(), []
            self._over = False
            self._number += 1
            self._changed.notify()

    def advance(self, step: int, events: Sequence[DriveEvent]) -> None:
        """Have the ghost do its next control step, after these events, unless its episode is over."""
        with self._changed:
            if not self._over:
                self._tasks.append(GhostStepInput(step, tuple(events)))
                self._changed.notify()

    def take_steps(self) -> list[GhostStepResult]:
        """Return the steps of the present ghost that were done since the last call."""
        with self._changed:
            steps, self._steps = self._steps, []
        return steps

    def close(self) -> None:
        """Kill the process."""
        with self._changed:
            self._closed = True
            self._changed.notify()
            if self._worker is not None:
                self._worker.process.kill()

    def _talk(self) -> None:
        try:
            with WorkerProcess("the ghost", build_ghost_loop, self._config) as worker:
                with self._changed:
                    self._worker = worker
                self._serve(worker)
        except Exception as error:
            self.failure = str(error) if isinstance(error, PdtuiError) else format_error_in_one_line(error)

    def _serve(self, worker: WorkerProcess) -> None:
        try:
            worker.send(answer_when_loaded)
            worker.receive()
            self.loaded = True
            while not self._closed:
                self._pass_on(worker)
        except WorkerError as error:
            how = describe_exit(worker.process)
            if worker.process.is_alive():  # a process that the robot itself had started
                raise
            raise WorkerError(f"it {how}") from error

    def _pass_on(self, worker: WorkerProcess) -> None:
        """Wait for something to do, and have it done."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._start is not None or self._tasks)
            if self._closed:
                return
            start, self._start = self._start, None
            tasks = [self._tasks.popleft() for _ in range(min(_STEPS_PER_CALL, len(self._tasks)))]
            number = self._number
        worker.send(run_ghost, start, tasks)
        steps: list[GhostStepResult] = worker.receive()
        with self._changed:
            if number == self._number:
                self._steps += steps
                self._over = bool(steps) and bool(steps[-1].ended)
                if self._over:
                    self._tasks.clear()
