"""Cost of roll-outs on a cluster, and from it a simulation of larger clusters."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from multiprocessing.reduction import ForkingPickler
from statistics import median

import numpy as np

from pdtui.benchmarks.cluster_cost_model import ChunkCost, estimate_batch_time, interpolate_cost
from pdtui.benchmarks.matching_benchmark import time_call_in_seconds
from pdtui.benchmarks.random_rollouts import draw_rollout_jobs
from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.probing.rollout_pool import RolloutChunk, RolloutPool, choose_chunk_size
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.stimulated_rollout import RolloutOutcome
from pdtui.robots import RobotSpec

NODES = (1, 2, 4, 8, 16, 32, 64)
"""Sizes of the simulated clusters."""
BYTES_PER_SECOND = 125e6
"""What the simulated network carries: 1 Gbit/s."""
_STARTS, _FIRST_SEED, _AT = 2, 1100, 50
_ANSWERS, _ROUND_TRIPS = 400, 40


@dataclass(frozen=True)
class SimulatedScaling:
    """Times of one batch of roll-outs on clusters of growing size, which were simulated, not measured.

    Attributes:
        batch: What the batch is, in words.
        rollouts: Its size.
        seconds: Simulated time on each of `NODES`, s.
    """

    batch: str
    rollouts: int
    seconds: tuple[float, ...]

    def speedup(self, index: int) -> float:
        """How many times as fast the batch is as on one node."""
        return self.seconds[0] / self.seconds[index]


@dataclass(frozen=True)
class ClusterBenchmark:
    """The result of `bench_cluster`.

    Attributes:
        robot: The robot's name.
        cores: Cores of the cluster that was measured.
        steps: Control steps of a roll-out.
        per_chunk: Roll-outs of the usual chunk; on a large cluster, chunks are smaller.
        alone: Core time of a roll-out in this process, s; median over rounds.
        processes: Core time of a roll-out in as many worker processes as the cluster has cores, s.
        cluster: The same on the cluster, s.
        single, usual: What a chunk of one roll-out and the usual chunk cost.
        file_bytes: Bytes of the policy, which are sent to each node once.
        cores_per_node: Cores of each simulated node.
        simulated: What larger clusters would take.
    """

    robot: str
    cores: int
    steps: int
    per_chunk: int
    alone: float
    processes: float
    cluster: float
    single: ChunkCost
    usual: ChunkCost
    file_bytes: int
    cores_per_node: int
    simulated: tuple[SimulatedScaling, ...]

    @property
    def overhead_per_rollout(self) -> float:
        """Time that an idle cluster adds to a roll-out of the usual chunk, s."""
        return self.usual.latency / self.per_chunk

    @property
    def bytes_per_rollout(self) -> float:
        """Bytes per roll-out that are sent and answered, in the usual chunk."""
        return self.usual.bytes / self.per_chunk


def bench_cluster(
    robot: RobotSpec,
    policy: str,
    cluster: RayCluster,
    *,
    rollouts: int = 480,
    steps: int = 60,
    rounds: int = 3,
    cores_per_node: int = 16,
    progress: StepProgress | None = None,
) -> ClusterBenchmark:
    """Measure the same roll-outs in this process, in worker processes and on a cluster, in turn.

    Raises:
        PdtuiError: The robot or the policy cannot be loaded, or the cluster loses a process.
    """
    cores = cluster.cores
    with (
        RolloutPool(robot, policy, 1) as alone,
        RolloutPool(robot, policy, cores) as processes,
        RolloutPool(robot, policy, cluster) as spread,
    ):
        starts = collect_start_states(alone.robot, alone.policy, _FIRST_SEED, _STARTS, at=_AT)
        units = alone.policy.units
        jobs = draw_rollout_jobs(rollouts, units, _STARTS)
        pools = (alone, processes, spread)
        for pool in pools:  # starts the processes before the clock
            outcomes = pool.run(jobs, starts, steps, 0)
        rates = []
        for number in range(rounds):
            if progress is not None:
                progress(number, rounds)
            seconds = [time_call_in_seconds(partial(pool.run, jobs, starts, steps, 0)) for pool in pools]
            rates.append(np.array(seconds) * (1, cores, cores) / rollouts)
        lockstep, per_chunk = alone.offers_lockstep, len(alone.divide(jobs, starts, steps, 0)[0][0])
    table = np.array(rates)
    compute, in_processes, on_cluster = np.median(table, axis=0).tolist()
    single, usual = (
        _measure_chunk(cluster, (jobs[:size], dict(enumerate(starts)), steps, 0), outcomes[:size], compute)
        for size in (1, per_chunk)
    )

    def simulate(batch: str, size: int) -> SimulatedScaling:
        seconds = []
        for nodes in NODES:
            cores = nodes * cores_per_node
            rollouts = choose_chunk_size(size, steps, lockstep=lockstep, cores=cores)
            cost = interpolate_cost(single, usual, (rollouts - 1) / max(1, per_chunk - 1))
            seconds.append(estimate_batch_time(-(-size // rollouts), cores, cost, BYTES_PER_SECOND))
        return SimulatedScaling(batch, size, tuple(seconds))

    return ClusterBenchmark(
        robot=robot.name,
        cores=cores,
        steps=steps,
        per_chunk=per_chunk,
        alone=compute,
        processes=in_processes,
        cluster=on_cluster,
        single=single,
        usual=usual,
        file_bytes=find_weights_file(policy).stat().st_size,
        cores_per_node=cores_per_node,
        simulated=tuple(simulate(batch, size) for batch, size in _plan_batches(units)),
    )


def _measure_chunk(
    cluster: RayCluster, chunk: RolloutChunk, answer: list[RolloutOutcome], compute: float
) -> ChunkCost:
    """Return what a chunk costs whose roll-outs take `compute` seconds each."""
    with WorkerPool("answers", cluster, answer, list, answer) as pool:
        pool.map(_answer_at_once, [chunk] * _ANSWERS)  # so that every process has the answer
        trips = []
        for _ in range(_ROUND_TRIPS):
            began = time.perf_counter()
            pool.map(_answer_at_once, [chunk])
            trips.append(time.perf_counter() - began)
        began = time.process_time()
        pool.map(_answer_at_once, [chunk] * _ANSWERS)
        driver = (time.process_time() - began) / _ANSWERS
    size = sum(len(ForkingPickler.dumps(one)) for one in (chunk, answer))
    return ChunkCost(compute * len(answer), median(trips), driver, size)


def _answer_at_once(answer: list[RolloutOutcome], _chunk: RolloutChunk) -> list[RolloutOutcome]:
    return answer


def _plan_batches(units: int) -> list[tuple[str, int]]:
    """Return what a dissection runs at a time: the largest batch, and the usual one."""
    settings = DissectionSettings()
    search = settings.behavior_search
    screen = units * len(settings.screen_values) * settings.screen_starts
    return [
        ("screening every unit", screen),
        ("a search's generation", search.children * search.quick_starts),
    ]
