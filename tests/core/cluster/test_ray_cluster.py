"""Jobs on a cluster of two nodes: what they return, how they fail, and what they survive."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.processes.worker_pool import WorkerPool
from tests.local_cluster import local_cluster


@pytest.fixture(scope="module")
def cluster() -> Iterator[RayCluster]:
    with local_cluster(2) as (joined, _):
        yield joined


def build_square(factor: int) -> int:
    return factor


def multiply(factor: int, job: int) -> tuple[int, int]:
    return factor * job, os.getpid()


def read_text(name: str, _job: int) -> tuple[str, str]:
    return Path(name).read_text(), str(Path(name).resolve())


def die_once(mark: str, job: int) -> int:
    """End this process by force, but only the first time that the job is run."""
    if job == 1 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return job


def die(_state: str, _job: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def note_run(folder: str, job: int) -> int:
    time.sleep(0.05)
    (Path(folder) / f"{job}-{os.getpid()}").touch()
    return job


def test_results_come_in_the_order_of_the_jobs_from_other_processes(cluster: RayCluster) -> None:
    told: list[tuple[int, int]] = []
    with WorkerPool("numbers", cluster, 0, build_square, 3) as pool:
        found = pool.map(multiply, range(100), lambda done, total: told.append((done, total)))
    assert [product for product, _ in found] == [3 * job for job in range(100)]
    assert told == [(done, 100) for done in range(1, 101)]
    assert os.getpid() not in {process for _, process in found}
