"""Compares ways to steer each attribute: units, pairs of them, directions of a layer, and imprints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.dissection.steering.linear_probes import LinearProbe
from pdtui.dissection.steering.steering_candidates import BASELINES, SteeringCandidate, SteeringMethod
from pdtui.dissection.steering.steering_results import SteeringComparison, SteeringResult
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import PlanEffects
from pdtui.probing.null_distributions import correct_for_comparisons, sign_flip_p_values
from pdtui.probing.start_states import StartState
from pdtui.stimulation.stimulation_map import MeasuredEffect

_ENOUGH = 0.7
"""Share of a method's largest effect that a smaller dose has to reach to be preferred."""


@dataclass(frozen=True)
class SteeringSettings:
    """How much work the comparison is. Each way has as many doses, so that all have the same chance.

    Attributes:
        starts: Starts on which each method chooses its source and its dose.
        sources: Number, even, of matched units, of probed units, of directions, and of units and directions
            drawn at random that are tried for each attribute. Half of the probed units are for one
            direction of the attribute; half of the directions are probes, of the best layers.
        values: Outputs of units, in size.
        lengths: Lengths of what is added along a direction, in the layer's own spread.
        readings: What an affine edit sets, in standard deviations of the attribute.
        factors: Factors on the smallest sizes of edits of the observation.
    """

    starts: int = 4
    sources: int = 4
    values: tuple[float, ...] = (2.0, 4.0, 8.0)
    lengths: tuple[float, ...] = (0.5, 1.0, 2.0)
    readings: tuple[float, ...] = (1.0, 2.0, 4.0)
    factors: tuple[float, ...] = (1.0, 2.0, 4.0)

    @property
    def half(self) -> int:
        """Half the number of sources, at least one."""
        return max(1, self.sources // 2)


def compare_steering(
    prober: EffectProbe,
    columns: Sequence[int],
    spread: Floats,
    candidates: Sequence[SteeringCandidate],
    probes: Sequence[LinearProbe],
    choosing: Sequence[StartState],
    judging: Sequence[StartState],
    steps: int,
    level: float,
    progress: StepProgress | None = None,
) -> SteeringComparison:
    """Let each method choose a source and a dose on some starts, and judge them on others.

    Effects are means over the last two thirds of the roll-outs.

    Args:
        prober: Runs the roll-outs.
        columns: Columns of the attributes that are to be moved; their side effects count, too.
        spread: Standard deviation of every attribute, shape (J,).
        candidates: What the methods try.
        probes: The linear probes that some of the candidates come from.
        choosing, judging: Starts; no walk serves both.
        steps: Control steps of a roll-out.
        level: Share of false discoveries that is accepted.
    """

    def measure(some: Sequence[SteeringCandidate], starts: Sequence[StartState]) -> PlanEffects:
        plans = [one.plan for one in some]
        return prober.measure_plans(plans, starts, steps=steps, measure_from=steps // 3, progress=progress)

    tried = measure(candidates, choosing)
    chosen = [
        (column, sign, row)
        for column in columns
        for sign in (1, -1)
        for row in _choose_per_method(candidates, tried, column, sign)
    ]
    rows = sorted({row for _, _, row in chosen})
    judged = measure([candidates[row] for row in rows], judging)
    effects = judged.counted_effects()
    scale = np.where(spread > 0, spread, 1.0)
    results, samples = [], []
    for column, sign, row in chosen:
        number = rows.index(row)
        sample, falls = effects[number, :, column], int(judged.falls[number].sum())
        interval = bootstrap_interval(sample, 0)
        means = effects[number].mean(axis=0) / scale
        samples.append(sample)
        results.append(
            SteeringResult(
                column,
                sign,
                candidates[row],
                MeasuredEffect(float(sample.mean()), *interval, falls, len(judging)),
                main=sign * float(means[column]),
                side=max((abs(float(means[other])) for other in columns if other != column), default=0.0),
                largest_dose=_largest_safe_dose(candidates, tried, row),
                p=1.0,
                p_random=None,
                level=level,
            )
        )
    methods = [one.method for one in candidates]
    return SteeringComparison(
        tuple(probes),
        tuple(_with_p_values(results, samples)),
        tuple(columns),
        {method: methods.count(method) for method in SteeringMethod if method in methods},
        len(choosing),
        len(judging),
    )


def _choose_per_method(
    candidates: Sequence[SteeringCandidate], tried: PlanEffects, column: int, sign: int
) -> Iterable[int]:
    """Yield the row of each method's candidate: of the strongest source, the smallest dose that is enough.

    Only those count that move the attribute from every start, without a fall.
    """
    effects = np.nan_to_num(sign * tried.effects[..., column], nan=-np.inf)
    sure = (effects.min(axis=1) > 0) & ~tried.falls.any(axis=1)
    means = np.where(sure, effects.mean(axis=1), 0.0)
    for method in SteeringMethod:
        own = [
            row
            for row, one in enumerate(candidates)
            if one.method is method and one.column in (None, column) and means[row] > 0
        ]
        if own:
            best = max(own, key=lambda row: means[row])
            source, least = candidates[best].source, _ENOUGH * means[best]
            enough = [row for row in own if candidates[row].source == source and means[row] >= least]
            yield min(enough, key=lambda row: (abs(candidates[row].dose), row))


def _largest_safe_dose(candidates: Sequence[SteeringCandidate], tried: PlanEffects, chosen: int) -> float:
    one = candidates[chosen]
    fell = {
        abs(other.dose): bool(tried.falls[row].any())
        for row, other in enumerate(candidates)
        if (other.method, other.column, other.source) == (one.method, one.column, one.source)
        and other.dose * one.dose > 0
    }
    larger = {dose: down for dose, down in fell.items() if dose >= abs(one.dose)}
    lowest = min((dose for dose, down in larger.items() if down), default=np.inf)
    return float(np.copysign(max(dose for dose in larger if dose < lowest), one.dose))


def _with_p_values(results: Sequence[SteeringResult], samples: Sequence[Floats]) -> list[SteeringResult]:
    """Return the results with p-values: one of the effect, one of its difference to the baseline's."""
    numbers = {(one.column, one.sign, one.method): row for row, one in enumerate(results)}
    alone, beside = [], []
    for one, sample in zip(results, samples, strict=True):
        alone.append(_one_sided(sample, one.sign))
        rival = numbers.get((one.column, one.sign, one.method.baseline))
        beside.append(_one_sided(sample if rival is None else sample - samples[rival], one.sign))
    compared = [row for row, one in enumerate(results) if one.method not in BASELINES]
    corrected = correct_for_comparisons(alone)
    against = dict(
        zip(compared, correct_for_comparisons([beside[row] for row in compared]).tolist(), strict=True)
    )
    return [
        replace(one, p=float(corrected[row]), p_random=against.get(row)) for row, one in enumerate(results)
    ]


def _one_sided(sample: Floats, sign: int) -> float:
    return float(sign_flip_p_values(sample)) if sign * sample.mean() > 0 else 1.0
