"""Worker processes: a single one that answers calls, and a pool that runs jobs on several."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache, partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.util import Finalize
from typing import Any, Generic, TypeVar

from pdtui.core.closable import Closable
from pdtui.core.cluster.ray_cluster import RayCluster, Workers
from pdtui.core.errors import WorkerError, format_error_in_one_line
from pdtui.core.processes.call_answer import CallAnswer, answer_call, take_answer
from pdtui.core.processes.process_start import start_process
from pdtui.core.processes.result_journal import Job, KeyedResultJournal, Result, map_missing

State = TypeVar("State")
StepProgress = Callable[[int, int], None]
"""Called with the units of work done and their total."""


class WorkerProcess(Closable):
    """A process that holds a state and answers function calls, one at a time.

    It ends when this process ends, in whatever way, and leaves Ctrl-C to this process.

    Args:
        name: what the process works on, for error messages.
        build: function of a module that returns the state; called in the new process.
        arguments: arguments of `build`.
    """

    def __init__(self, name: str, build: Callable[..., object], *arguments: Any) -> None:
        self.name = name
        self.connection, theirs = multiprocessing.Pipe()
        try:
            self.process = start_process(
                f"pdtui {name}", build.__module__, _serve_calls, theirs, build, arguments
            )
        finally:
            theirs.close()
        # A daemon would be ended in the same way, but could not start processes itself.
        Finalize(self, self.process.kill, exitpriority=0)

    def send(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Call a function of a module with the state and arguments; `WorkerError` if the process is dead."""
        try:
            self.connection.send((function, arguments))
        except OSError as error:
            raise self._death() from error

    def receive(self) -> Any:
        """Wait for the result of the call and return it, or raise the exception that the call raised.

        The death of the process is a `WorkerError`.
        """
        try:
            answer = self.connection.recv()
        except (EOFError, OSError) as error:
            raise self._death() from error
        return take_answer(answer)

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
    """Runs jobs in worker processes, in this process if there is only one worker, or on a cluster.

    The first jobs start the processes, which are kept for later jobs. An exception in a job is raised in this
    process, and the death of a worker is reported at once; both end all workers. On a cluster, jobs whose
    process or node is lost are run again elsewhere.

    Args:
        name: what the workers work on, for error messages.
        workers: number of processes, or a cluster.
        state: state for jobs that run in this process.
        build: function of a module that returns the state of a worker; called in each worker.
        arguments: arguments of `build`.
    """

    def __init__(
        self, name: str, workers: Workers, state: State, build: Callable[..., State], *arguments: Any
    ) -> None:
        self._name, self._workers, self._state = name, workers, state
        self._build, self._arguments = build, arguments
        self._processes: list[WorkerProcess] = []
        self._recipe: list[Any] = []

    def close(self) -> None:
        """Kill the worker processes; later jobs start new ones. Those of a cluster belong to Ray."""
        self._recipe = []
        while self._processes:
            self._processes.pop().close()

    def map(
        self,
        function: Callable[[State, Job], Result],
        jobs: Sequence[Job],
        progress: StepProgress | None = None,
        journal: KeyedResultJournal[Job, Result] | None = None,
    ) -> list[Result]:
        """Run all jobs and return their results in the order of the jobs; `WorkerError` if a worker dies.

        Args:
            function: function of a module, called with the worker's state and a job.
            jobs: one argument of `function` each.
            progress: called with the number of jobs finished and of all jobs.
            journal: keeps each result; jobs whose results it holds are not run. None for none.
        """
        return map_missing(partial(self.as_completed, function), jobs, journal, progress)

    def as_completed(
        self, function: Callable[[State, Job], Result], jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Result]]:
        """Run all jobs and yield the index and the result of each as soon as it is finished.

        The death of a worker is a `WorkerError`.
        """
        if isinstance(self._workers, RayCluster):
            self._recipe = self._recipe or self._workers.put_recipe(self._build, self._arguments)
            yield from self._workers.as_completed(self._name, self._recipe, function, jobs)
            return
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
                raise WorkerError(f"{error}; with one worker, everything runs in this process") from error
            raise


def describe_exit(process: BaseProcess) -> str:
    """Return how a process ended that has closed its pipe, such as "was killed by SIGKILL"."""
    # The pipe closes slightly before the exit code is known.
    process.join(timeout=1.0)
    code = process.exitcode
    if code is not None and code < 0:
        return f"was killed by {signal.Signals(-code).name}"
    return f"ended with code {code}"


def _serve_calls(connection: Connection, build: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Answer calls until the pipe is closed. The first call builds the state, and reports errors in that."""
    threading.Thread(target=end_with_parent, daemon=True).start()
    state = cache(partial(build, *arguments))
    with suppress(EOFError, OSError):
        while True:
            function, values = connection.recv()
            _send_answer(connection, answer_call(_call_with, state, function, values))


def _call_with(state: Callable[[], Any], function: Callable[..., Any], values: tuple[Any, ...]) -> Any:
    return function(state(), *values)


def _send_answer(connection: Connection, answer: CallAnswer) -> None:
    try:
        connection.send(answer)
    except OSError:
        raise
    except Exception as error:  # the answer cannot be pickled
        connection.send((False, TypeError(f"{answer[1]!r}: {format_error_in_one_line(error)}")))


def end_with_parent(patience: float = 0.0) -> None:
    """Wait until this process's parent has ended, and end this process too; run it in a thread of its own.

    Nobody else can end a process that is busy or stuck once its parent has been killed.

    Args:
        patience: time that this process has to end by itself, s.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        multiprocessing.connection.wait([parent.sentinel])
        time.sleep(patience)
        os._exit(1)
