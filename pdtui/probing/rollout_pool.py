"""Roll-outs on several cores: each worker process has its own robot and policy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from pdtui.core.closable import Closable
from pdtui.core.worker_pool import WorkerPool
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_fit import check_fit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, WorldSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, run_rollout
from pdtui.robots import make_robot, open_robot
from pdtui.robots.robot import Robot
from pdtui.spectra.monitor import StepProgress

# Control steps handed over at once: long enough to hide the hand-over, short enough to stop within a second.
_STEPS_A_CHUNK = 1200

WorkItem = TypeVar("WorkItem")
WorkResult = TypeVar("WorkResult")
_Pair = tuple[Robot, Policy]


@dataclass(frozen=True)
class _Chunk:
    jobs: Sequence[RolloutJob]
    starts: dict[int, StartState]
    steps: int
    measure_from: int


def _build_pair(robot: str, policy: str, import_options: ImportOptions) -> _Pair:
    world = make_robot(robot)
    return world, _load(policy, world, import_options)


def _load(policy: str | Path, world: Robot, import_options: ImportOptions) -> Policy:
    return load_policy(policy, world.name, import_options=import_options, spaces=WorldSpaces.of_world(world))


def _apply(
    function: Callable[[Robot, Policy, WorkItem], WorkResult], pair: _Pair, item: WorkItem
) -> WorkResult:
    return function(*pair, item)


def _roll_out_chunk(pair: _Pair, chunk: _Chunk) -> list[RolloutOutcome]:
    return [
        run_rollout(*pair, chunk.starts[index], plan, chunk.steps, chunk.measure_from)
        for plan, index in chunk.jobs
    ]


class RolloutPool(Closable):
    """Runs roll-outs of one policy on one robot; with one worker in this process, else in others.

    The results do not depend on the number of workers: each roll-out is a function of its snapshot and plan.
    Processes are started by the first call of `run`, not before.

    Args:
        robot: name of the robot, or a robot.
        policy: weights file, name of a shipped policy, or a policy.
        workers: processes, which load robot and policy by their names; what is given as an object stays in
            this one.
        import_options: what the weights file leaves open.

    Raises:
        RobotError: no such robot.
        PolicyError: no such policy, one for another robot, or one whose shapes do not fit it.
    """

    def __init__(
        self,
        robot: str | Robot,
        policy: str | Path | Policy,
        workers: int = 2,
        import_options: ImportOptions = NO_OPTIONS,
    ) -> None:
        # Built here too: the caller needs both, and what is wrong with them is raised in this process.
        with ExitStack() as stack:
            self.robot = stack.enter_context(open_robot(robot))
            self.policy = policy if isinstance(policy, Policy) else _load(policy, self.robot, import_options)
            check_fit(self.policy, self.robot, self.robot.name)
            self._resources = stack.pop_all()
        named = isinstance(robot, str) and not isinstance(policy, Policy)
        self._pool = WorkerPool(
            f"roll-outs of {self.robot.name}",
            workers if named else 1,
            (self.robot, self.policy),
            _build_pair,
            *(robot, str(policy), import_options),
        )
        self.steps_run = 0
        self.rollouts = 0

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
        done: Callable[[int], None] | None = None,
        keep: Callable[[Sequence[int], Sequence[RolloutOutcome]], None] | None = None,
    ) -> list[RolloutOutcome]:
        """Roll out every job; results in the order of the jobs.

        Args:
            jobs: what to overwrite, and the number of the start from which.
            starts: snapshots.
            steps: control steps of each roll-out.
            measure_from: first step that counts.
            done: called with the number of jobs finished so far.
            keep: called with each batch of finished jobs, by number, and their outcomes.

        Raises:
            WorkerError: a worker process died.
        """
        size = max(1, _STEPS_A_CHUNK // steps)
        parts = [jobs[low : low + size] for low in range(0, len(jobs), size)]
        chunks = [
            _Chunk(part, {index: starts[index] for _, index in part}, steps, measure_from) for part in parts
        ]
        results: list[list[RolloutOutcome]] = [[] for _ in chunks]
        finished = 0
        for number, outcomes in self._pool.as_completed(_roll_out_chunk, chunks):
            results[number] = outcomes
            finished += len(outcomes)
            self.count(outcomes)
            if keep is not None:
                keep(range(number * size, number * size + len(outcomes)), outcomes)
            if done is not None:
                done(finished)
        return [outcome for outcomes in results for outcome in outcomes]

    def map(
        self,
        function: Callable[[Robot, Policy, WorkItem], WorkResult],
        items: Sequence[WorkItem],
        progress: StepProgress | None = None,
    ) -> list[WorkResult]:
        """Apply a function of a module to robot, policy and each item; results in the order of the items.

        Raises:
            WorkerError: a worker process died.
        """
        return self._pool.map(partial(_apply, function), items, progress)

    def count(self, outcomes: Sequence[RolloutOutcome]) -> None:
        """Take roll-outs into `rollouts` and `steps_run`, wherever they were run."""
        self.rollouts += len(outcomes)
        self.steps_run += sum(outcome.steps_survived for outcome in outcomes)
