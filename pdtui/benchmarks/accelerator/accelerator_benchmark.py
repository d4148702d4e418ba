"""`pdtui bench accelerator`: all units of the Ant screened on an accelerator and on the CPU, in one run."""

from __future__ import annotations

import time

import jax
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.benchmarks.accelerator.accelerator_benchmark_result import AcceleratorBenchmark, AttributeAgreement
from pdtui.benchmarks.accelerator.mjx_rollouts import NO_UNIT, MjxOutcomes, MjxRollouts
from pdtui.core.attributes import Floats
from pdtui.core.errors import PdtuiError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states
from pdtui.probing.stimulated_rollout import RolloutJob
from pdtui.robots import RobotSpec
from pdtui.robots.ant import Ant

_FIRST_SEED, _AT = 1100, range(100, 200)
_STRONGEST_SHARE = 0.1


def bench_accelerator(
    robot: RobotSpec,
    policy: str,
    *,
    units: int = 0,
    outputs: tuple[float, ...] = (-3.0, 3.0),
    starts: int = 6,
    steps: int = 60,
    workers: int = 2,
    progress: StepProgress | None = None,
) -> AcceleratorBenchmark:
    """Overwrite each unit alone with each output from common starts; measure the second half of the steps.

    Args:
        robot: The Ant, and its options.
        policy: Its policy.
        units: Number of units, evenly over all of them; 0 for all.
        outputs: Values that overwrite each unit.
        starts: Number of common starts, an even number.
        steps: Control steps of a roll-out.
        workers: Number of worker processes.
        progress: Is told how many of four parts are done.

    Raises:
        PdtuiError: The robot is no Ant, or the policy no multilayer perceptron.
    """
    report = progress or (lambda _done, _of: None)
    with RolloutPool(robot, policy, workers) as pool:
        ant = pool.robot
        if not isinstance(ant, Ant):
            raise PdtuiError(f"{robot.name}: expected the robot ant; of no other does JAX have the formulas")
        chosen = np.arange(pool.policy.units)
        if units:
            chosen = np.unique(np.linspace(0, pool.policy.units - 1, units).round().astype(np.intp))
        common = collect_start_states(ant, pool.policy, _FIRST_SEED, starts, at=_AT)
        plans = [(NO_UNIT, 0.0), *((int(unit), output) for unit in chosen for output in outputs)]
        report(1, 4)
        started = time.perf_counter()
        rollouts = MjxRollouts(ant, pool.policy, steps, steps // 2)
        _run_on_accelerator(rollouts, plans, common)
        first = time.perf_counter() - started
        report(2, 4)
        started = time.perf_counter()
        fast = _run_on_accelerator(rollouts, plans, common)
        accelerator_seconds = time.perf_counter() - started
        report(3, 4)
        pool.run([(NO_STIMULATION, 0)] * 8 * workers, common, steps, 0)  # starts the worker processes
        started = time.perf_counter()
        exact = _run_on_cpu(pool, plans, common, steps)
        cpu_seconds = time.perf_counter() - started
        report(4, 4)
        names = [attribute.name for attribute in ant.attributes]
    effects, exact_effects = _effects(fast, starts), _effects(exact, starts)
    return AcceleratorBenchmark(
        device=jax.devices()[0].device_kind,
        workers=workers,
        rollouts=len(plans) * starts,
        steps=steps,
        compile_seconds=first - accelerator_seconds,
        accelerator_seconds=accelerator_seconds,
        cpu_seconds=cpu_seconds,
        falls=(float(fast.falls.mean()), float(exact.falls.mean())),
        same_falls=float((fast.falls == exact.falls).mean()),
        attributes=tuple(
            _compare(name, effects[:, :, column], exact_effects[:, :, column])
            for column, name in enumerate(names)
        ),
    )


def _run_on_accelerator(
    rollouts: MjxRollouts, plans: list[tuple[int, float]], starts: list[StartState]
) -> MjxOutcomes:
    units, outputs = (np.repeat(values, len(starts)) for values in zip(*plans, strict=True))
    return rollouts.run(starts, units, outputs, np.tile(np.arange(len(starts)), len(plans)))


def _run_on_cpu(
    pool: RolloutPool, plans: list[tuple[int, float]], starts: list[StartState], steps: int
) -> MjxOutcomes:
    jobs: list[RolloutJob] = [
        (NO_STIMULATION if unit == NO_UNIT else Stimulation((unit,), (output,)), index)
        for unit, output in plans
        for index in range(len(starts))
    ]
    outcomes = pool.run(jobs, starts, steps, steps // 2)
    return MjxOutcomes(
        np.array([outcome.means for outcome in outcomes]),
        np.array([outcome.outcome is not None for outcome in outcomes]),
    )


def _effects(outcomes: MjxOutcomes, starts: int) -> Floats:
    """Return what each plan changes from each start, shape (plans, starts, J); 0 where it falls."""
    means = outcomes.means.reshape(-1, starts, outcomes.means.shape[1])
    fallen = outcomes.falls.reshape(-1, starts)
    effects: Floats = means[1:] - means[:1]
    effects[fallen[1:] | fallen[:1]] = 0.0
    return effects


def _compare(name: str, fast: Floats, exact: Floats) -> AttributeAgreement:
    """Compare the effects on one attribute, each of shape (plans, starts)."""
    mean, exact_mean = np.abs(fast.mean(axis=1)), np.abs(exact.mean(axis=1))
    count = max(1, round(_STRONGEST_SHARE * len(mean)))
    strongest, found = (set(_strongest(values, count).tolist()) for values in (exact_mean, mean))
    return AttributeAgreement(
        name=name,
        correlation=_correlate(fast.mean(axis=1), exact.mean(axis=1)),
        cpu_correlation=_correlate(exact[:, ::2].mean(axis=1), exact[:, 1::2].mean(axis=1)),
        shared=len(strongest & found) / count,
        confirmed=float(exact_mean[mean.argmax()] / exact_mean.max()),
    )


def _strongest(values: Floats, count: int) -> NDArray[np.intp]:
    return np.argsort(-values, kind="stable")[:count]


def _correlate(one: Floats, other: Floats) -> float:
    return float(stats.spearmanr(one, other).statistic)
