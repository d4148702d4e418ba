"""Worker processes: one that answers calls, and a pool of them that shares out jobs."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache, partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from pdtui.core.closable import Closable
from pdtui.core.errors import PdtuiError, WorkerError, format_error_in_one_line

State = TypeVar("State")
Job = TypeVar("Job")
Result = TypeVar("Result")


class WorkerProcess(Closable):
    """A process of its own that holds a state and calls functions on it, one at a time.

    The process is spawned, ends when this one ends, however that happens, and leaves Ctrl-C to it.

    Args:
        name: what the process is for, as error messages call it.
        build: called with `arguments` in the new process; what it returns is the state.
    """

    def __init__(self, name: str, build: Callable[..., object], *arguments: Any) -> None:
        self.name = name
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(
            target=_serve_calls, args=(theirs, build, arguments), name=f"pdtui {name}", daemon=True
        )
        # Ctrl-C reaches the whole process group. A worker inherits that the signal is blocked, from its first
        # instruction on: only this process answers it, and no worker prints a traceback.
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
            theirs.close()

    def send(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Have the process call a function of a module with its state and these arguments.

        Raises:
            WorkerError: the process has died.
        """
        try:
            self.connection.send((function, arguments))
        except OSError as error:
            raise self._death() from error

    def receive(self) -> Any:
        """Wait for the result of the call that was sent; what it raised is raised here.

        Raises:
            WorkerError: the process has died.
        """
        try:
            succeeded, answer = self.connection.recv()
        except (EOFError, OSError) as error:
            raise self._death() from error
        if not succeeded:
            raise answer
        return answer

    def close(self) -> None:
        """Kill the process."""
        self.process.kill()
        self.process.join()
        self.connection.close()

    def _death(self) -> WorkerError:
        how = describe_exit(self.process)
        cause = " (out of memory?)" if self.process.exitcode == -signal.SIGKILL else ""
        return WorkerError(f"{self.name}: a worker process {how}{cause}")


class WorkerPool(Closable, Generic[State]):
    """Runs jobs in worker processes, or in this process if there is only one worker.

    Processes are started by the first jobs and kept for later ones. An error ends all of them: that of a job
    is raised here, and a worker that dies is reported at once.

    Args:
        name: what the workers do, as error messages call it.
        workers: number of processes.
        state: what jobs are run on in this process.
        build: called with `arguments` in each worker process; returns what jobs are run on there.
    """

    def __init__(
        self, name: str, workers: int, state: State, build: Callable[..., State], *arguments: Any
    ) -> None:
        self._name, self._workers, self._state = name, workers, state
        self._build, self._arguments = build, arguments
        self._processes: list[WorkerProcess] = []

    def close(self) -> None:
        """Kill the worker processes; later jobs start new ones."""
        while self._processes:
            self._processes.pop().close()

    def map(
        self,
        function: Callable[[State, Job], Result],
        jobs: Sequence[Job],
        progress: Callable[[int, int], None] | None = None,
    ) -> list[Result]:
        """Run all jobs and return their results in the order of the jobs.

        Args:
            function: of a module; called with the worker's state and a job.
            jobs: what to run.
            progress: called with the number of jobs finished and of all jobs.

        Raises:
            WorkerError: a worker process died.
        """
        results: dict[int, Result] = {}
        for number, result in self.as_completed(function, jobs):
            results[number] = result
            if progress is not None:
                progress(len(results), len(jobs))
        return [results[number] for number in range(len(jobs))]

    def as_completed(
        self, function: Callable[[State, Job], Result], jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Result]]:
        """Run all jobs and yield each one's number and result as soon as it is finished.

        Raises:
            WorkerError: a worker process died.
        """
        if self._workers <= 1:
            for number, job in enumerate(jobs):
                yield number, function(self._state, job)
            return
        waiting = iter(enumerate(jobs))
        busy: dict[Connection, tuple[WorkerProcess, int]] = {}

        def send_next(worker: WorkerProcess) -> None:
            for number, job in waiting:
                worker.send(function, job)
                busy[worker.connection] = (worker, number)
                return

        try:
            while len(self._processes) < min(self._workers, len(jobs)):
                self._processes.append(WorkerProcess(self._name, self._build, *self._arguments))
            for worker in self._processes:
                send_next(worker)
            while busy:
                for connection in multiprocessing.connection.wait(list(busy)):
                    worker, number = busy.pop(connection)  # type: ignore[call-overload]
                    result = worker.receive()
                    send_next(worker)
                    yield number, result
        except BaseException as error:
            self.close()
            if isinstance(error, WorkerError):
                raise WorkerError(f"{error}; with one worker, all runs in this process") from error
            raise


def describe_exit(process: BaseProcess) -> str:
    """Say how a process ended that closed its end of a pipe: "was killed by SIGKILL"."""
    # A process closes its pipes a little before it can be waited for.
    process.join(timeout=1.0)
    code = process.exitcode
    if code is not None and code < 0:
        return f"was killed by {signal.Signals(-code).name}"
    return f"ended with code {code}"


def _serve_calls(connection: Connection, build: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Answer calls until the other end is closed; an error in building the state answers the first call."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    state = cache(partial(build, *arguments))
    with suppress(EOFError, OSError):
        while True:
            function, values = connection.recv()
            answer: tuple[bool, Any]
            try:
                answer = True, function(state(), *values)
            except Exception as error:
                if not isinstance(error, PdtuiError):
                    # The traceback itself stays behind.
                    error.add_note(f"In a worker process:\n{traceback.format_exc()}")
                answer = False, error
            _send(connection, answer)


def _send(connection: Connection, answer: tuple[bool, Any]) -> None:
    try:
        connection.send(answer)
    except OSError:
        raise
    except Exception as error:  # the answer cannot be pickled
        connection.send((False, TypeError(f"{answer[1]!r}: {format_error_in_one_line(error)}")))


def _end_with_parent() -> None:
    """A parent that is killed, or whose terminal closes, tells nobody: without this a busy worker stays."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)
