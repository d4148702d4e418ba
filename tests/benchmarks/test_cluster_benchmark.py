"""The simulation of larger clusters, against times worked out by hand, and the size of chunks."""

from __future__ import annotations

import pytest

from pdtui.benchmarks.cluster_cost_model import ChunkCost, estimate_batch_time, interpolate_cost
from pdtui.probing.rollout_pool import choose_chunk_size

COST = ChunkCost(compute=1.0, latency=0.25, driver=0.1, bytes=1000)
FAST = 1e12
"""Bytes per second of a network that never waits."""


@pytest.mark.parametrize(
    ("chunks", "cores", "network", "seconds"),
    [
        (1, 1, FAST, 0.1 + 1.25),
        (3, 1, FAST, 0.1 + 3 * 1.25),  # the driver sends while the core works
        (4, 4, FAST, 0.4 + 1.25),  # the last chunk is sent at 0.4
        (4, 100, FAST, 0.4 + 1.25),  # more cores than chunks are of no use
        (8, 4, FAST, 0.4 + 2 * 1.25),
        (100, 100, FAST, 10.0 + 1.25),  # the driver is the bottleneck
        (4, 4, 2000.0, 2.0 + 1.25),  # the network is, with half a second per chunk
    ],
)
def test_a_batch_takes_as_long_as_its_slowest_part(
    chunks: int, cores: int, network: float, seconds: float
) -> None:
    assert estimate_batch_time(chunks, cores, COST, network) == pytest.approx(seconds)


def test_the_cost_of_a_chunk_between_two_sizes() -> None:
    large = ChunkCost(compute=3.0, latency=0.25, driver=0.3, bytes=5000)
    between = interpolate_cost(COST, large, 0.5)
    assert (between.compute, between.latency, between.bytes) == (2.0, 0.25, 3000)
    assert between.driver == pytest.approx(0.2)
    assert interpolate_cost(COST, large, 0.0) == COST


def test_chunks_are_small_enough_for_a_cluster_and_large_enough_for_its_driver() -> None:
    assert choose_chunk_size(4096, 60, lockstep=False) == 20
    assert choose_chunk_size(4096, 60, lockstep=False, cores=16) == 20
    assert choose_chunk_size(84, 60, lockstep=False, cores=16) == 2
    assert choose_chunk_size(84, 60, lockstep=False, cores=1024) == 1
    assert choose_chunk_size(4096, 60, lockstep=False, cores=1024) == 8
    # Roll-outs in lock step would differ by rounding.
    assert choose_chunk_size(84, 60, lockstep=True, cores=1024) == choose_chunk_size(84, 60, lockstep=True)
