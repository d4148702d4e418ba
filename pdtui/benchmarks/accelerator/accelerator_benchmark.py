"""`pdtui bench accelerator`: all units of the Ant screened on an accelerator and on the CPU, in one run."""

from __future__ import annotations

import time

import jax
import numpy as np
from numpy.typing import NDArray

from pdtui.benchmarks.accelerator.accelerator_benchmark_result import AcceleratorBenchmark, AttributeAgreement
from pdtui.benchmarks.accelerator.mjx_rollouts import NO_UNIT, MjxOutcomes, MjxRollouts
from pdtui.core.attributes import Floats
from pdtui.core.errors import PdtuiError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.matching_hits import rank_correlation
from pdtui.probing.measured_effects import PlanEffects
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states
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
        fast = _to_effects(_run_on_accelerator(rollouts, plans, common), starts)
        accelerator_seconds = time.perf_counter() - started
        report(3, 4)
        pool.run([(NO_STIMULATION, 0)] * 8 * workers, common, steps, 0)  # starts the worker processes
        started = time.perf_counter()
        stimulations = [Stimulation((unit,), (output,)) for unit, output in plans[1:]]
        exact = EffectProbe(pool).measure_plans(stimulations, common, steps=steps)
        cpu_seconds = time.perf_counter() - started
        report(4, 4)
        names = [attribute.name for attribute in ant.attributes]
    effects, exact_effects = fast.counted_effects(), exact.counted_effects()
    falls, exact_falls = _all_falls(fast), _all_falls(exact)
    return AcceleratorBenchmark(
        device=jax.devices()[0].device_kind,
        workers=workers,
        rollouts=len(plans) * starts,
        steps=steps,
        compile_seconds=first - accelerator_seconds,
        accelerator_seconds=accelerator_seconds,
        cpu_seconds=cpu_seconds,
        falls=(float(falls.mean()), float(exact_falls.mean())),
        same_falls=float((falls == exact_falls).mean()),
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


def _to_effects(outcomes: MjxOutcomes, starts: int) -> PlanEffects:
    """Return the effects of roll-outs, those without stimulation first."""
    means = outcomes.means.reshape(-1, starts, outcomes.means.shape[1])
    falls = outcomes.falls.reshape(-1, starts)
    return PlanEffects(
        effects=means[1:] - means[:1],
        means=means[1:],
        unperturbed=means[0],
        falls=falls[1:],
        errors=np.full(falls[1:].shape, np.nan),
        unperturbed_falls=falls[0],
    )


def _all_falls(effects: PlanEffects) -> NDArray[np.bool_]:
    return np.vstack([effects.unperturbed_falls, effects.falls])


def _compare(name: str, fast: Floats, exact: Floats) -> AttributeAgreement:
    """Compare the effects on one attribute, each of shape (plans, starts)."""
    mean, exact_mean = np.abs(fast.mean(axis=1)), np.abs(exact.mean(axis=1))
    count = max(1, round(_STRONGEST_SHARE * len(mean)))
    strongest, found = (set(_strongest(values, count).tolist()) for values in (exact_mean, mean))
    return AttributeAgreement(
        name=name,
        correlation=rank_correlation(fast.mean(axis=1), exact.mean(axis=1)),
        cpu_correlation=rank_correlation(exact[:, ::2].mean(axis=1), exact[:, 1::2].mean(axis=1)),
        shared=len(strongest & found) / count,
        confirmed=float(exact_mean[mean.argmax()] / exact_mean.max()),
    )


def _strongest(values: Floats, count: int) -> NDArray[np.intp]:
    return np.argsort(-values, kind="stable")[:count]
