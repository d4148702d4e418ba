"""Roll-outs on several cores: each worker process has its own robot and policy."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import TypeVar

from pdtui.core.closable import Closable
from pdtui.core.errors import RobotError
from pdtui.core.worker_processes import obey_parent
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_fit import check_fit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, WorldSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, roll_out
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.spectra.monitor import StartState, StepProgress

# Control steps handed over at once: long enough to hide the hand-over, short enough to stop within a second.
_STEPS_A_CHUNK = 1200

_worker: tuple[Robot, Policy] | None = None
WorkItem = TypeVar("WorkItem")
WorkResult = TypeVar("WorkResult")


def _start_worker(robot: str, policy: str, import_options: ImportOptions) -> None:
    global _worker  # noqa: PLW0603  (a process's own robot is its global state)
    obey_parent()
    world = make_robot(robot)
    _worker = (world, _load(policy, world, import_options))


def _load(policy: str | Path, world: Robot, import_options: ImportOptions) -> Policy:
    return load_policy(policy, world.name, import_options=import_options, spaces=WorldSpaces.of_world(world))


def _apply(function: Callable[[Robot, Policy, WorkItem], WorkResult], item: WorkItem) -> WorkResult:
    assert _worker is not None
    return function(*_worker, item)


def _run_chunk(
    jobs: Sequence[RolloutJob], starts: dict[int, StartState], steps: int, measure_from: int
) -> list[RolloutOutcome]:
    assert _worker is not None
    return _run(_worker, jobs, starts, steps, measure_from)


def _run(
    pair: tuple[Robot, Policy],
    jobs: Sequence[RolloutJob],
    starts: dict[int, StartState],
    steps: int,
    measure_from: int,
) -> list[RolloutOutcome]:
    return [roll_out(*pair, starts[index], plan, steps, measure_from) for plan, index in jobs]


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
        self.robot = make_robot(robot) if isinstance(robot, str) else robot
        self.policy = policy if isinstance(policy, Policy) else _load(policy, self.robot, import_options)
        check_fit(self.policy, self.robot, self.robot.name)
        named = isinstance(robot, str) and not isinstance(policy, Policy)
        self._names = (robot if isinstance(robot, str) else robot.name, str(policy), import_options)
        self._workers = max(1, workers) if named else 1
        self._pool: ProcessPoolExecutor | None = None
        self.steps_run = 0
        self.rollouts = 0

    def close(self) -> None:
        """End the worker processes; a later `run` starts new ones."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None

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
            RobotError: a worker process died.
        """
        size = max(1, _STEPS_A_CHUNK // steps)
        chunks = [jobs[low : low + size] for low in range(0, len(jobs), size)]
        results: list[list[RolloutOutcome]] = [[] for _ in chunks]
        finished = 0
        for number, outcomes in self._chunks(chunks, starts, steps, measure_from):
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
            RobotError: a worker process died.
        """
        results: list[WorkResult] = []
        if self._workers == 1:
            for item in items:
                results.append(function(self.robot, self.policy, item))
                if progress is not None:
                    progress(len(results), len(items))
            return results
        try:
            for result in self._processes().map(_apply, [function] * len(items), items):
                results.append(result)
                if progress is not None:
                    progress(len(results), len(items))
        except BrokenProcessPool as error:
            raise self._died() from error
        except BaseException:
            self.close()
            raise
        return results

    def count(self, outcomes: Sequence[RolloutOutcome]) -> None:
        """Take roll-outs into `rollouts` and `steps_run`, wherever they were run."""
        self.rollouts += len(outcomes)
        self.steps_run += sum(outcome.lived for outcome in outcomes)

    def _chunks(
        self,
        chunks: Sequence[Sequence[RolloutJob]],
        starts: Sequence[StartState],
        steps: int,
        measure_from: int,
    ) -> Iterator[tuple[int, list[RolloutOutcome]]]:
        needed = [{index: starts[index] for _, index in chunk} for chunk in chunks]
        if self._workers == 1:
            for number, chunk in enumerate(chunks):
                yield number, _run((self.robot, self.policy), chunk, needed[number], steps, measure_from)
            return
        pool = self._processes()
        futures: dict[Future[list[RolloutOutcome]], int] = {}
        try:
            for number, chunk in enumerate(chunks):
                future = pool.submit(_run_chunk, chunk, needed[number], steps, measure_from)
                futures[future] = number
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise self._died() from error
        except BaseException:
            self.close()
            raise

    def _processes(self) -> ProcessPoolExecutor:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._workers,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_start_worker,
                initargs=self._names,
            )
        return self._pool

    def _died(self) -> RobotError:
        return RobotError(
            f"{self.robot.name}: a worker process died (out of memory, or killed); one worker runs "
            "without other processes"
        )
