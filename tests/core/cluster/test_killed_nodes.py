"""A cluster of three local nodes, of which one is killed in mid-run, and a driver that is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.processes.worker_pool import WorkerPool
from pdtui.policies.weights.weights_file import load_network
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.rollout_journal import RolloutJournal
from tests.core.cluster.cluster_driver import ROLLOUTS, probe_units
from tests.deadline import deadline
from tests.local_cluster import local_cluster

pytestmark = pytest.mark.slow  # three nodes start in 15 s, and each test probes for as long


@pytest.fixture(scope="module")
def expected(policy_file: Path, tmp_path_factory: pytest.TempPathFactory) -> UnitEffects:
    """What one machine measures."""
    return probe_units(policy_file, tmp_path_factory.mktemp("journals") / "here.sqlite", 1)


@pytest.fixture
def three_nodes() -> Iterator[tuple[RayCluster, Any]]:
    with local_cluster(3) as nodes:
        yield nodes


def assert_same(found: UnitEffects, expected: UnitEffects) -> None:
    np.testing.assert_array_equal(found.effects, expected.effects)
    np.testing.assert_array_equal(found.falls, expected.falls)
    np.testing.assert_array_equal(found.unperturbed, expected.unperturbed)


def count_rows(journal: Path) -> int:
    with RolloutJournal(journal, "test") as kept:
        return len(kept)


def test_a_killed_node_loses_nothing_and_nothing_counts_twice(
    three_nodes: tuple[RayCluster, Any],
    policy_file: Path,
    tmp_path: Path,
    expected: UnitEffects,
    capfd: pytest.CaptureFixture[str],
) -> None:
    cluster, nodes = three_nodes
    victim, told = next(iter(nodes.worker_nodes)), list[int]()

    def kill_a_node(done: int, _total: int) -> None:
        told.append(done)
        if len(told) == 3:
            nodes.remove_node(victim, allow_graceful=False)

    assert cluster.cores == 3
    found = probe_units(policy_file, tmp_path / "journal.sqlite", cluster, kill_a_node)
    assert_same(found, expected)
    assert told == sorted(set(told))
    assert told[-1] == count_rows(tmp_path / "journal.sqlite") == ROLLOUTS
    assert capfd.readouterr().out == ""  # what goes wrong on a node is not mixed with a command's JSON


def wait_a_moment(folder: str, job: int) -> int:
    (Path(folder) / f"{job}-{os.getpid()}-{time.time_ns()}").touch()
    time.sleep(0.5)
    return job


def test_jobs_of_a_killed_node_and_only_those_are_run_again(
    three_nodes: tuple[RayCluster, Any], tmp_path: Path
) -> None:
    cluster, nodes = three_nodes
    victim, found = next(iter(nodes.worker_nodes)), list[int]()
    with WorkerPool("jobs", cluster, "", str, str(tmp_path)) as pool:
        for number, result in pool.as_completed(wait_a_moment, range(20)):
            assert number == result
            found.append(result)
            if len(found) == 6:
                nodes.remove_node(victim, allow_graceful=False)
    assert sorted(found) == list(range(20))
    runs = [path.name.partition("-")[0] for path in tmp_path.iterdir()]
    assert set(runs) == {str(job) for job in range(20)}
    # A node of one core runs one job, and may have begun another.
    assert len(runs) - 20 <= 2


def test_a_killed_driver_goes_on_from_its_journal(
    three_nodes: tuple[RayCluster, Any], policy_file: Path, tmp_path: Path, expected: UnitEffects
) -> None:
    cluster, journal = three_nodes[0], tmp_path / "journal.sqlite"
    arguments = [three_nodes[1].address, str(policy_file), str(journal)]
    with (
        subprocess.Popen([sys.executable, "-m", "tests.core.cluster.cluster_driver", *arguments]) as driver,
        deadline(120),
    ):
        while not journal.exists() or count_rows(journal) < ROLLOUTS // 4:
            time.sleep(0.1)
        driver.send_signal(signal.SIGKILL)
    kept = count_rows(journal)
    assert ROLLOUTS // 4 <= kept < ROLLOUTS
    told = list[int]()
    found = probe_units(policy_file, journal, cluster, lambda done, _: told.append(done))
    assert_same(found, expected)
    assert told[0] > kept  # what the journal held was not run again
    assert count_rows(journal) == ROLLOUTS


def test_training_goes_on_without_killed_nodes(three_nodes: tuple[RayCluster, Any], tmp_path: Path) -> None:
    pytest.importorskip("jax", reason="the extra 'train' is not installed")
    from pdtui.training.train_policy import train_policy

    cluster, nodes = three_nodes
    victims = list(nodes.worker_nodes)  # Ray may have left one of them idle
    told = list[int]()

    def kill_nodes(steps: int, _total: int, _note: str) -> None:
        told.append(steps)
        while victims:
            nodes.remove_node(victims.pop(), allow_graceful=False)

    for folder, where in (("here", None), ("there", cluster)):
        told.clear()
        progress = None if where is None else kill_nodes
        arguments = ("ant", "sac", 0, 4000, None, None, tmp_path / folder, progress)
        train_policy(*arguments, layers=(8, 8), cluster=where)
    assert not victims
    assert len(set(told)) < len(told)  # there was no checkpoint yet, so the run began again
    here, there = (load_network(tmp_path / one / "best.safetensors") for one in ("here", "there"))
    for name, tensor in here.state_dict().items():
        assert torch.equal(tensor, there.state_dict()[name])
