"""A worker process goes back to a state that no library restores, and ends with its parent all the same."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from pdtui.core.processes.process_checkpoint import (
    can_hold_state,
    hold_state,
    return_and_release_state,
    return_to_held_state,
)
from pdtui.core.processes.worker_pool import WorkerProcess

pytestmark = pytest.mark.skipif(not can_hold_state(), reason="holds states on Linux only")


class Counter:
    """A state in a process of its own."""

    def __init__(self) -> None:
        self.count = 0

    def add(self) -> int:
        self.count += 1
        return self.count

    def hold(self) -> int:
        hold_state()
        return self.count

    def back(self) -> None:
        return_to_held_state()

    def release(self) -> None:
        return_and_release_state()

    def number(self) -> int:
        return os.getpid()


def _ask(worker: WorkerProcess, function: object) -> int:
    worker.send(function)  # type: ignore[arg-type]
    answer: int = worker.receive()
    return answer


def test_it_goes_back_as_often_as_asked_and_goes_on_from_there() -> None:
    with WorkerProcess("counting", Counter) as worker:
        first = _ask(worker, Counter.number)
        assert [_ask(worker, Counter.add) for _ in range(3)] == [1, 2, 3]
        assert _ask(worker, Counter.hold) == 3
        for _ in range(3):
            assert [_ask(worker, Counter.add) for _ in range(2)] == [4, 5]
            assert _ask(worker, Counter.number) != first
            assert _ask(worker, Counter.back) == 3
        assert _ask(worker, Counter.release) == 3
        assert (_ask(worker, Counter.number), _ask(worker, Counter.add)) == (first, 4)


def test_the_copy_ends_with_the_process_that_is_closed() -> None:
    worker = WorkerProcess("counting", Counter)
    _ask(worker, Counter.hold)
    copy = _ask(worker, Counter.number)
    worker.close()
    deadline = time.monotonic() + 60
    while Path(f"/proc/{copy}").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not Path(f"/proc/{copy}").exists()


def test_the_process_ends_with_its_copy() -> None:
    worker = WorkerProcess("counting", Counter)
    _ask(worker, Counter.hold)
    os.kill(_ask(worker, Counter.number), signal.SIGKILL)
    worker.process.join(60)
    assert worker.process.exitcode == 1
    worker.close()
