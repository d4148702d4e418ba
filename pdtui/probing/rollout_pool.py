"""Roll-outs on several cores, where each worker process has its own robot and policy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from functools import cached_property, partial
from pathlib import Path
from typing import TypeVar

from pdtui.core.closable import Closable
from pdtui.core.cluster.ray_cluster import RayCluster, Workers
from pdtui.core.processes.result_journal import KeyedResultJournal
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_compatibility import check_policy_fit
from pdtui.policies.weights.cluster_policy_files import send_policy_files
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.lockstep_rollouts import FEWEST_TOGETHER, make_lockstep_rollouts
from pdtui.probing.rollout_batch import run_rollouts
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome
from pdtui.robots import RobotSpec, make_robot, open_robot
from pdtui.robots.robot import Robot

# Control steps that a worker is sent at once: enough to make the cost of sending them negligible, few enough
# for progress to be reported about once per second.
_STEPS_PER_CHUNK = 1200
# Long roll-outs in lock step are worth a longer wait: this many together, in no fewer chunks than that.
_LARGEST_BATCH, _LEAST_CHUNKS = 16, 4
# On a cluster, this many chunks per core keep all cores busy; but one process sends about 1000 per second.
_CHUNKS_PER_CORE, _MOST_CHUNKS = 2, 512

WorkItem = TypeVar("WorkItem")
WorkResult = TypeVar("WorkResult")
_Pair = tuple[Robot, Policy]
RolloutChunk = tuple[Sequence[RolloutJob], dict[int, StartState], int, int]
"""Jobs, their starts by index, the steps of each roll-out, and the first step that is measured."""


def _build_pair(robot: RobotSpec, policy: str, import_options: ImportOptions) -> _Pair:
    world = make_robot(robot)
    world.allow_near_restores()
    return world, _load(policy, world, import_options)


def _load(policy: str | Path, world: Robot, import_options: ImportOptions) -> Policy:
    return load_policy(
        policy, world.name, import_options=import_options, spaces=ObservationActionSpaces.of_world(world)
    )


def _apply(work: Callable[[Robot, Policy, WorkItem], WorkResult], pair: _Pair, item: WorkItem) -> WorkResult:
    return work(*pair, item)


def _run_chunk(pair: _Pair, chunk: RolloutChunk) -> list[RolloutOutcome]:
    jobs, starts, steps, measure_from = chunk
    return run_rollouts(*pair, starts, jobs, steps, measure_from)


def choose_chunk_size(rollouts: int, steps: int, *, lockstep: bool, cores: int = 1) -> int:
    """Return how many roll-outs a worker is sent at once.

    On a cluster, they are few enough for all cores to have work. Those in lock step do not depend on the
    cluster, so that neither do their results, to the last bit.

    Args:
        rollouts: Number of roll-outs.
        steps: Control steps of each.
        lockstep: Whether they run in lock step.
        cores: Cores of the cluster; 1 for worker processes.
    """
    size = max(1, _STEPS_PER_CHUNK // steps)
    if lockstep:
        return max(size, min(_LARGEST_BATCH, rollouts // _LEAST_CHUNKS))
    chunks = min(_CHUNKS_PER_CORE * cores, _MOST_CHUNKS)
    return size if cores == 1 else max(1, min(size, rollouts // chunks))


class RolloutPool(Closable):
    """Runs roll-outs of one policy on one robot, in a `WorkerPool`: in worker processes, or on a cluster.

    The results do not depend on the workers, as each roll-out depends on its start and plan only.
    Those in lock step, see `run_rollouts`, also depend on which run together, but not beyond rounding.

    Each worker process loads robot and policy by name. If one of the two is given as an object, all roll-outs
    run in this process. The import options say what the weights file leaves open.

    Raises:
        RobotError: no such robot.
        PolicyError: no such policy, or one that does not fit the robot.
    """

    def __init__(
        self,
        robot: str | RobotSpec | Robot,
        policy: str | Path | Policy,
        workers: Workers = 2,
        import_options: ImportOptions = NO_OPTIONS,
    ) -> None:
        # Also built in this process: callers need both, and errors in them are raised at once.
        with ExitStack() as stack:
            self.robot = stack.enter_context(open_robot(robot))
            self.policy = policy if isinstance(policy, Policy) else _load(policy, self.robot, import_options)
            check_policy_fit(self.policy, self.robot, self.robot.name)
            self._resources = stack.pop_all()
        by_name = isinstance(robot, str | RobotSpec)
        if by_name:
            self.robot.allow_near_restores()
        if not by_name or isinstance(policy, Policy):
            workers = 1
        name, options = str(policy), import_options
        if workers != 1:
            name, options = send_policy_files(workers, name, options)
        self._workers = workers
        self._pool = WorkerPool(
            f"roll-outs of {self.robot.name}",
            workers,
            (self.robot, self.policy),
            _build_pair,
            *(RobotSpec(self.robot.name, dict(self.robot.build_options)), name, options),
        )
        self.rollouts = self.control_steps = 0

    def close(self) -> None:
        """End the worker processes, and close the robot if it was built here."""
        self._pool.close()
        self._resources.close()

    def run(
        self,
        jobs: Sequence[RolloutJob],
        starts: Sequence[StartState],
        steps: int,
        measure_from: int,
        keep: Callable[[Sequence[int], Sequence[RolloutOutcome]], None] | None = None,
    ) -> list[RolloutOutcome]:
        """Run all jobs and return their outcomes in the order of the jobs.

        `keep` is called with the indices of finished jobs and with their outcomes, as they are finished.

        Raises:
            WorkerError: a worker process died.
        """
        divided = self.divide(jobs, starts, steps, measure_from)
        results: dict[int, RolloutOutcome] = {}
        for index, outcomes in self._pool.as_completed(_run_chunk, [chunk for _, chunk in divided]):
            numbers = divided[index][0]
            results |= zip(numbers, outcomes, strict=True)
            self.count_rollouts(outcomes)
            if keep is not None:
                keep(numbers, outcomes)
        return [results[number] for number in range(len(jobs))]

    def divide(
        self, jobs: Sequence[RolloutJob], starts: Sequence[StartState], steps: int, measure_from: int
    ) -> list[tuple[list[int], RolloutChunk]]:
        """Return the parts that workers are sent at once, each with the indices of its jobs."""
        cores = self._workers.cores if isinstance(self._workers, RayCluster) else 1
        size = choose_chunk_size(len(jobs), steps, lockstep=self.offers_lockstep, cores=cores)
        # Roll-outs from one start follow each other, because some robots return to the last start quickly.
        order = sorted(range(len(jobs)), key=lambda number: jobs[number][1])
        divided: list[tuple[list[int], RolloutChunk]] = []
        for low in range(0, len(jobs), size):
            numbers = order[low : low + size]
            part = [jobs[number] for number in numbers]
            divided.append(
                (numbers, (part, {index: starts[index] for _, index in part}, steps, measure_from))
            )
        return divided

    def map(
        self,
        function: Callable[[Robot, Policy, WorkItem], WorkResult],
        items: Sequence[WorkItem],
        progress: StepProgress | None = None,
        journal: KeyedResultJournal[WorkItem, WorkResult] | None = None,
    ) -> list[WorkResult]:
        """Call a function with robot, policy and each item, and return the results in order.

        The function has to be a module's, so that worker processes can import it. Items whose results the
        journal holds are left out.

        Raises:
            WorkerError: a worker process died.
        """
        return self._pool.map(partial(_apply, function), items, progress, journal)

    @cached_property
    def offers_lockstep(self) -> bool:
        """Whether roll-outs that overwrite units run in lock step."""
        return make_lockstep_rollouts(self.robot, self.policy, FEWEST_TOGETHER) is not None

    def count_rollouts(self, outcomes: Iterable[RolloutOutcome]) -> None:
        """Add roll-outs to `rollouts` and `control_steps`, whether they were run here or read from a file."""
        for outcome in outcomes:
            self.rollouts += 1
            self.control_steps += outcome.steps_survived
