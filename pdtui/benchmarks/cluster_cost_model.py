"""A simulation of how long a batch of roll-outs takes on clusters larger than any that was measured."""

from __future__ import annotations

import heapq
from dataclasses import dataclass


@dataclass(frozen=True)
class ChunkCost:
    """What one chunk of roll-outs costs.

    Attributes:
        compute: Time that a core works on it, s.
        latency: Time that an idle cluster adds between sending it and having its answer, s.
        driver: Processor time that it takes in the process that sends it and takes its answer, s.
        bytes: Bytes that are sent and answered.
    """

    compute: float
    latency: float
    driver: float
    bytes: int


def interpolate_cost(small: ChunkCost, large: ChunkCost, share: float) -> ChunkCost:
    """Return the cost of a chunk whose size lies between two, at this share of the way."""

    def between(low: float, high: float) -> float:
        return low + share * (high - low)

    return ChunkCost(
        between(small.compute, large.compute),
        between(small.latency, large.latency),
        between(small.driver, large.driver),
        round(between(small.bytes, large.bytes)),
    )


def estimate_batch_time(chunks: int, cores: int, cost: ChunkCost, bytes_per_second: float) -> float:
    """Return the time that a batch of equal chunks takes, s.

    The driver sends one chunk after another, to whichever core is free first. It does nothing else at the
    same time, and its network carries no more than `bytes_per_second`, whichever of the two is slower. The
    nodes are equal, nothing fails, and every core has built its robot already.

    Args:
        chunks: Number of chunks.
        cores: Number of cores on all nodes.
        cost: What a chunk costs.
        bytes_per_second: Bytes per second that the driver's network carries.
    """
    each = max(cost.driver, cost.bytes / bytes_per_second)
    free = [0.0] * cores
    sent = 0.0
    for _ in range(chunks):
        sent += each
        begun = max(sent, heapq.heappop(free))
        heapq.heappush(free, begun + cost.latency + cost.compute)
    return max(free)
