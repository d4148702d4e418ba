"""`pdtui bench rollouts`: roll-outs one by one and in lock step, and the simulators alone, in one run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.benchmarks.matching_benchmark import time_call_in_seconds
from pdtui.benchmarks.random_rollouts import draw_rollout_jobs
from pdtui.core.errors import PdtuiError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.rollout_batch import run_rollouts
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, run_rollout
from pdtui.robots import RobotSpec
from pdtui.robots.robot import Robot

_STARTS, _FIRST_SEED, _AT = 2, 1100, 50
_PER_PART = 24
_RolloutWork = Callable[[Robot, Policy, "_RolloutShare"], int | list[RolloutOutcome]]


@dataclass(frozen=True)
class RolloutBenchmark:
    """The result of `bench_rollouts`.

    Attributes:
        robot: The robot's name.
        workers: Number of worker processes.
        bare: Control steps per second of the robots alone, which repeat the actions of unstimulated walks.
        one_by_one, lockstep: Control steps per second of stimulated roll-outs; medians over rounds.
        one_by_one_share, lockstep_share: Median over rounds of these over `bare`.
        ratio: Median over rounds of `lockstep` over `one_by_one`.
        difference: Largest difference of an attribute's mean between the two, over its standard deviation
            among the roll-outs.
        same_order: Share of places in the order of the roll-outs by an attribute that are the same.
    """

    robot: str
    workers: int
    bare: float
    one_by_one: float
    lockstep: float
    one_by_one_share: float
    lockstep_share: float
    ratio: float
    difference: float
    same_order: float


@dataclass(frozen=True)
class _RolloutShare:
    """Roll-outs for one worker, and the actions of an unstimulated walk from each of their starts."""

    jobs: Sequence[RolloutJob]
    starts: dict[int, StartState]
    actions: dict[int, list[NDArray[np.float32]]]
    steps: int


def bench_rollouts(
    robot: RobotSpec,
    policy: str,
    *,
    rollouts: int = 192,
    steps: int = 60,
    rounds: int = 5,
    workers: int = 2,
    progress: StepProgress | None = None,
) -> RolloutBenchmark:
    """Measure the same roll-outs, each of one unit at a random output, in turn in each round.

    Raises:
        PdtuiError: The robot or the policy cannot be loaded, or they have no roll-outs in lock step.
    """
    with RolloutPool(robot, policy, workers) as pool:
        if not pool.offers_lockstep:
            raise PdtuiError(
                f"{robot}: expected a robot and a policy whose roll-outs can run in lock step, as those of "
                "anymal and cassie; here, they run one by one"
            )
        work = _share_out(pool, rollouts, steps)
        pool.map(_repeat_actions, work)  # starts the worker processes before the clock
        rates = []
        for number in range(rounds):
            if progress is not None:
                progress(number, rounds)
            rates.append([_rate(pool, part, work) for part in (_repeat_actions, _one_by_one, _together)])
        alone, together = (
            [outcome for outcomes in pool.map(part, work) for outcome in outcomes]
            for part in (_one_by_one, _together)
        )
    table = np.array(rates)
    bare, one_by_one, lockstep = np.median(table, axis=0).tolist()
    one_by_one_share, lockstep_share = np.median(table[:, 1:] / table[:, :1], axis=0).tolist()
    difference, same_order = compare_outcomes(alone, together)
    return RolloutBenchmark(
        robot=robot.name,
        workers=workers,
        bare=bare,
        one_by_one=one_by_one,
        lockstep=lockstep,
        one_by_one_share=one_by_one_share,
        lockstep_share=lockstep_share,
        ratio=float(np.median(table[:, 2] / table[:, 1])),
        difference=difference,
        same_order=same_order,
    )


def _share_out(pool: RolloutPool, rollouts: int, steps: int) -> list[_RolloutShare]:
    """Return roll-outs in parts, each from the same few starts."""
    starts = dict(enumerate(collect_start_states(pool.robot, pool.policy, _FIRST_SEED, _STARTS, at=_AT)))
    actions = {index: _walk_on(pool.robot, pool.policy, start, steps) for index, start in starts.items()}
    jobs = draw_rollout_jobs(rollouts, pool.policy.units, _STARTS)
    parts = [jobs[low : low + _PER_PART] for low in range(0, rollouts, _PER_PART)]
    return [_RolloutShare(part, starts, actions, steps) for part in parts]


def _walk_on(robot: Robot, policy: Policy, start: StartState, steps: int) -> list[NDArray[np.float32]]:
    """Return the actions of a walk without stimulation."""
    robot.restore(start.snapshot)
    policy.restore(start.policy_state)
    observation, actions = robot.observe(), []
    for _ in range(steps):
        actions.append(policy.act(observation).action)
        observation, _, terminated, truncated, _ = robot.step(actions[-1])
        if terminated or truncated:
            break
    return actions


def _repeat_actions(robot: Robot, _policy: Policy, share: _RolloutShare) -> int:
    """Let the simulator alone repeat the actions of walks, and return the number of control steps."""
    for _, index in share.jobs:
        robot.restore(share.starts[index].snapshot)
        for action in share.actions[index]:
            robot.step(action)
    return sum(len(share.actions[index]) for _, index in share.jobs)


def _one_by_one(robot: Robot, policy: Policy, share: _RolloutShare) -> list[RolloutOutcome]:
    return [
        run_rollout(robot, policy, share.starts[index], plan, share.steps, 0) for plan, index in share.jobs
    ]


def _together(robot: Robot, policy: Policy, share: _RolloutShare) -> list[RolloutOutcome]:
    return run_rollouts(robot, policy, share.starts, share.jobs, share.steps, 0)


def _rate(pool: RolloutPool, part: _RolloutWork, work: Sequence[_RolloutShare]) -> float:
    """Return control steps per second."""
    done: list[int | list[RolloutOutcome]] = []
    seconds = time_call_in_seconds(lambda: done.extend(pool.map(part, work)))
    steps = [one if isinstance(one, int) else sum(each.steps_survived for each in one) for one in done]
    return sum(steps) / seconds


def compare_outcomes(
    alone: Sequence[RolloutOutcome], together: Sequence[RolloutOutcome]
) -> tuple[float, float]:
    """Return the largest difference of a mean over its spread, and how much of the order is the same."""
    one, other = (np.array([outcome.means for outcome in all_]) for all_ in (alone, together))
    whole = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    one, other = one[whole], other[whole]
    spread = one.std(axis=0)
    varies = spread > 0
    difference = float((np.abs(one - other)[:, varies] / spread[varies]).max())
    orders = [np.argsort(means[:, varies], axis=0, kind="stable") for means in (one, other)]
    return difference, float((orders[0] == orders[1]).mean())
