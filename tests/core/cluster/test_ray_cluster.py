"""Jobs on a cluster of two nodes: what they return, how they fail, and what they survive."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.cluster.node_jobs import lock_folder
from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.errors import ClusterError, RobotError, WorkerError
from pdtui.core.processes.worker_pool import WorkerPool
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.robots import make_robot
from pdtui.training.remote.spread_robot_batch import SpreadRobotBatch
from pdtui.training.robot_batch import RobotBatch
from tests.batch_agreement import check_worlds_are_the_same
from tests.core.processes.test_worker_pool import count_calls, divide, fail_on_three, fail_to_build
from tests.local_cluster import local_cluster


@pytest.fixture(scope="module")
def cluster() -> Iterator[RayCluster]:
    with local_cluster(2) as (joined, _):
        yield joined


def note_build(folder: str) -> str:
    (Path(folder) / f"built-{os.getpid()}").touch()
    return folder


def multiply(factor: int, job: int) -> tuple[int, int]:
    return factor * job, os.getpid()


def read_text(_state: str, name: str) -> tuple[str, str]:
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
    with WorkerPool("numbers", cluster, 3, int, 3) as pool:
        found = pool.map(multiply, range(100), lambda done, total: told.append((done, total)))
    assert [product for product, _ in found] == [3 * job for job in range(100)]
    assert told == [(done, 100) for done in range(1, 101)]
    assert os.getpid() not in {process for _, process in found}


def test_a_process_builds_its_state_once_and_is_kept(cluster: RayCluster, tmp_path: Path) -> None:
    with WorkerPool("numbers", cluster, "", note_build, str(tmp_path)) as pool:
        pool.map(note_run, range(20))
        pool.map(note_run, range(20, 40))
    processes = {path.name.rpartition("-")[2] for path in tmp_path.glob("[0-9]*")}
    assert sorted(path.name for path in tmp_path.glob("built-*")) == sorted(
        f"built-{one}" for one in processes
    )


def test_what_a_job_raises_is_raised_here(cluster: RayCluster) -> None:
    with WorkerPool("numbers", cluster, [0], list, [0]) as pool:
        with pytest.raises(RobotError, match="three is too many"):
            pool.map(fail_on_three, range(6))
        with pytest.raises(ZeroDivisionError) as caught:
            pool.map(divide, (1, 0))
        assert "return 1 / job" in caught.value.__notes__[0]
        assert pool.map(fail_on_three, (1, 2)) == [1, 2]
    with (
        WorkerPool("nothing", cluster, [0], fail_to_build) as pool,
        pytest.raises(RobotError, match="nothing"),
    ):
        pool.map(fail_on_three, range(2))


def test_a_file_is_there_by_its_hash_wherever_it_was_here(cluster: RayCluster, tmp_path: Path) -> None:
    first, second, other = tmp_path / "a.txt", tmp_path / "folder" / "a.txt", tmp_path / "b.txt"
    second.parent.mkdir()
    for path, text in ((first, "one"), (second, "one"), (other, "two")):
        path.write_text(text)
    names = [cluster.add_file(path) for path in (first, second, other)]
    assert names[0] == names[1] != names[2]
    for path in (first, second, other):
        path.unlink()
    with WorkerPool("texts", cluster, "", str) as pool:
        ((text, place),) = pool.map(read_text, names[2:])
    assert text == "two"
    assert not place.startswith(str(tmp_path))
    with pytest.raises(ClusterError, match=r"a\.txt: cannot be read"):
        cluster.add_file(first)


def test_the_folders_of_dead_processes_are_removed(cluster: RayCluster, tmp_path: Path) -> None:
    (tmp_path / "own.txt").write_text("one")
    name = cluster.add_file(tmp_path / "own.txt")
    with cluster.start_worker("texts", str) as worker:
        worker.send(read_text, name)
        folder = Path(worker.receive()[1]).parents[1]
        assert lock_folder(folder) is None
    for _ in range(100):
        if (descriptor := lock_folder(folder)) is not None:
            os.close(descriptor)
            break
        time.sleep(0.1)
    assert folder.exists()
    with cluster.start_worker("texts", str) as worker:
        worker.send(read_text, name)
        worker.receive()
    assert not folder.exists()


def test_a_job_whose_process_is_killed_is_run_again(cluster: RayCluster, tmp_path: Path) -> None:
    mark = str(tmp_path / "died")
    with WorkerPool("numbers", cluster, mark, str, mark) as pool:
        assert pool.map(die_once, range(6)) == list(range(6))
    assert Path(mark).exists()


@pytest.mark.slow  # a process starts four times
def test_a_job_that_always_kills_its_process_is_an_error(cluster: RayCluster) -> None:
    with (
        WorkerPool("numbers", cluster, "", str) as pool,
        pytest.raises(WorkerError, match="numbers: the cluster"),
    ):
        pool.map(die, [0])


def test_a_worker_keeps_its_state_between_calls(cluster: RayCluster) -> None:
    with cluster.start_worker("numbers", list, [0]) as worker:
        for expected in (1, 2):
            worker.send(count_calls, 7)
            assert worker.receive()[:2] == (7, expected)
        worker.send(divide, 0)
        with pytest.raises(ZeroDivisionError):
            worker.receive()
        worker.send(die, 0)
        with pytest.raises(WorkerError, match="numbers: the cluster lost"):
            worker.receive()


def test_other_versions_on_a_node_are_refused(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pdtui.core.cluster.ray_cluster.describe_installation", lambda: {"numpy": "0.1"})
    with (
        WorkerPool("numbers", cluster, 0, int) as pool,
        pytest.raises(ClusterError, match=r"numpy 0\.1 as on"),
    ):
        pool.map(multiply, [1])


def test_roll_outs_are_those_of_one_machine_though_the_file_is_only_there(
    cluster: RayCluster, policy_file: Path, tmp_path: Path
) -> None:
    own = tmp_path / "own.safetensors"
    own.write_bytes(policy_file.read_bytes())
    found = []
    for workers in (1, cluster):
        with RolloutPool("ant", own, workers) as pool:
            if workers is cluster:
                own.unlink()
            starts = collect_start_states(pool.robot, pool.policy, 1000, 2, at=20)
            found.append(EffectProbe(pool).measure_units(range(3), (-3.0, 3.0), starts, steps=60))
            assert pool.rollouts == 14
    np.testing.assert_array_equal(found[0].effects, found[1].effects)
    np.testing.assert_array_equal(found[0].unperturbed, found[1].unperturbed)


def test_worlds_on_a_cluster_step_alike_and_go_on_from_a_kept_state(cluster: RayCluster) -> None:
    here = RobotBatch(partial(make_robot, "ant"), 3, 5)
    there = SpreadRobotBatch("ant", {}, 3, 5, cluster, 2)
    check_worlds_are_the_same(here, there)
    there.close()


@pytest.mark.parametrize("address", ["nowhere", "127.0.0.1:1", "ray://127.0.0.1:10001", "127.0.0.1:99999999"])
def test_an_address_without_a_cluster_is_told_in_one_line(address: str) -> None:
    with pytest.raises(ClusterError, match="cluster") as caught:
        RayCluster(address).connect()
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_only_this_machine_can_reach_it(cluster: RayCluster) -> None:
    tables = [Path(f"/proc/net/{name}").read_text().splitlines()[1:] for name in ("tcp", "tcp6")]
    listening = {
        row.split()[9]: row.split()[1] for table in tables for row in table if row.split()[3] == "0A"
    }
    bound = {
        listening[inode]
        for process in find_ray_processes()
        for inode in find_sockets(process)
        if inode in listening
    }
    hosts = {address.partition(":")[0] for address in bound}
    assert len(bound) > 3
    assert hosts <= {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}


def find_ray_processes() -> list[Path]:
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            words = (folder / "cmdline").read_bytes()
            if b"raylet" in words or b"gcs_server" in words or words.startswith(b"ray::"):
                found.append(folder)
    return found


def find_sockets(process: Path) -> Iterator[str]:
    for link in (process / "fd").glob("*"):
        with suppress(OSError):
            target = str(link.readlink())
            if target.startswith("socket:["):
                yield target[8:-1]
