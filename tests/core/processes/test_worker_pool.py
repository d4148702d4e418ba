"""Worker processes: what they return, how they fail, and when they end."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from pdtui.core.errors import RobotError, WorkerError
from pdtui.core.processes.worker_pool import WorkerPool, WorkerProcess
from tests.deadline import deadline

STATE = [0]


def count_calls(state: list[int], job: int) -> tuple[int, int, int]:
    """The job, how many this worker has done, and which process it is."""
    state[0] += 1
    return job, state[0], os.getpid()


def fail_on_three(_state: list[int], job: int) -> int:
    if job == 3:
        raise RobotError("three is too many")
    return job


def divide(_state: list[int], job: int) -> float:
    return 1 / job


def return_lambda(_state: list[int], _job: int) -> object:
    return lambda: None


def interrupt_itself(_state: list[int], job: int) -> int:
    os.kill(os.getpid(), signal.SIGINT)
    return job


def fail_to_build() -> list[int]:
    raise RobotError("nothing to build from")


def sleep_long(_state: list[int], _job: int) -> None:
    time.sleep(600)


def sleep_unless_first(_state: list[int], job: int) -> None:
    time.sleep(600 if job else 0)


def make_pool(workers: int) -> WorkerPool[list[int]]:
    return WorkerPool("numbers", workers, list(STATE), list, STATE)


def test_results_come_in_the_order_of_the_jobs() -> None:
    told: list[tuple[int, int]] = []
    with make_pool(2) as pool:
        first = pool.map(count_calls, range(8), lambda done, total: told.append((done, total)))
        processes = {process for _, _, process in first}
        again = pool.map(count_calls, range(3))
    assert [job for job, _, _ in first] == list(range(8))
    assert told == [(done, 8) for done in range(1, 9)]
    assert os.getpid() not in processes
    # Each worker has built its state once, and is kept.
    assert sum(max(n for _, n, process in first if process == one) for one in processes) == 8
    assert {process for _, _, process in again} <= processes
    assert not multiprocessing.active_children()


def test_results_as_they_are_finished_carry_the_number_of_their_job() -> None:
    with make_pool(2) as pool:
        assert {n: job for n, (job, _, _) in pool.as_completed(count_calls, (5, 6, 7))} == {0: 5, 1: 6, 2: 7}


def test_one_worker_works_in_this_process() -> None:
    with make_pool(1) as pool:
        assert pool.map(count_calls, (7, 8)) == [(7, 1, os.getpid()), (8, 2, os.getpid())]
        assert not multiprocessing.active_children()


def test_what_a_job_raises_is_raised_here() -> None:
    with make_pool(2) as pool:
        with pytest.raises(RobotError, match="three is too many"):
            pool.map(fail_on_three, range(6))
        with pytest.raises(ZeroDivisionError) as caught:
            pool.map(divide, (1, 0))
        assert "return 1 / job" in caught.value.__notes__[0]
        with pytest.raises(TypeError, match="lambda"):
            pool.map(return_lambda, (1, 2))
        assert pool.map(fail_on_three, (1, 2)) == [1, 2]


def test_what_goes_wrong_while_a_worker_is_built_is_raised_here() -> None:
    with WorkerPool("nothing", 2, [0], fail_to_build) as pool, pytest.raises(RobotError, match="nothing to"):
        pool.map(count_calls, range(2))


def test_a_worker_leaves_ctrl_c_to_its_parent() -> None:
    with make_pool(2) as pool:
        assert pool.map(interrupt_itself, (1, 2)) == [1, 2]


def test_a_killed_worker_is_reported_while_the_others_work() -> None:
    with make_pool(2) as pool, deadline(30):
        results = pool.as_completed(sleep_unless_first, range(3))
        assert next(results) == (0, None)
        multiprocessing.active_children()[0].kill()
        with pytest.raises(
            WorkerError, match=r"numbers: a worker process was killed by SIGKILL .*one worker"
        ):
            next(results)
        assert not multiprocessing.active_children()
        assert pool.map(fail_on_three, (1, 2)) == [1, 2]


def test_a_worker_that_dies_before_its_next_call_is_reported() -> None:
    with WorkerProcess("numbers", list, STATE) as worker, deadline(30):
        worker.send(count_calls, 1)
        assert worker.receive()[:2] == (1, 1)
        worker.process.kill()
        worker.process.join()
        with pytest.raises(WorkerError, match="killed by SIGKILL"):
            worker.send(count_calls, 2)


def test_an_abandoned_run_ends_its_workers() -> None:
    with make_pool(2) as pool, deadline(30):
        results = pool.as_completed(sleep_unless_first, range(3))
        next(results)
        results.close()  # type: ignore[attr-defined]
        assert not multiprocessing.active_children()


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_busy_workers_end_when_their_parent_is_killed() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "tests.core.processes.test_worker_pool"], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        workers = [int(word) for word in parent.stdout.readline().split()]
        assert len(workers) == 2
        assert all(is_alive(worker) for worker in workers)
        parent.kill()
    for _ in range(300):
        if not any(is_alive(worker) for worker in workers):
            return
        time.sleep(0.1)
    pytest.fail(f"still alive: {[worker for worker in workers if is_alive(worker)]}")


def is_alive(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    # Nobody may be left to collect its exit status.
    return state != "Z"


def keep_workers_busy() -> None:
    """Print the workers' process numbers once both have begun to work, and wait for ever."""
    with make_pool(2) as pool:
        pool.map(count_calls, range(2))
        threading.Thread(target=pool.map, args=(sleep_long, range(2)), daemon=True).start()
        print(*(child.pid for child in multiprocessing.active_children()), flush=True)
        time.sleep(600)


if __name__ == "__main__":
    keep_workers_busy()
