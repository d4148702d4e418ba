"""Step 5, probe: stimulate from common snapshots, and measure against the unperturbed roll-out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.core.attributes import Floats
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.rollout_journal import RolloutJournal, fingerprint_start
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, RolloutPlan
from pdtui.spectra.monitor import StartState, StepProgress


@dataclass(frozen=True)
class PlanEffects:
    """What each of S plans does from each of K starts.

    Attributes:
        effects: change of each attribute against the unperturbed roll-out from the same start, in its unit,
            shape (S, K, J). Each is a difference of means over the measured steps; of an angle, of its mean
            change since the start. NaN where the robot fell before the measured steps.
        means: the stimulated means themselves, shape (S, K, J).
        unperturbed: the means without stimulation, shape (K, J).
        falls: whether it fell, shape (S, K).
        errors: mean distance from the target, for plans that hold one, else NaN; shape (S, K).
    """

    effects: Floats
    means: Floats
    unperturbed: Floats
    falls: NDArray[np.bool_]
    errors: Floats


class EffectProber:
    """Measures stimulations; remembers the unperturbed roll-outs, which every comparison needs again.

    Args:
        crew: runs the roll-outs.
        journal: remembers them on disk, and those of a run that was interrupted.
    """

    def __init__(self, crew: RolloutPool, journal: RolloutJournal | None = None) -> None:
        self.crew, self._journal = crew, journal
        self._unperturbed: dict[tuple[bytes, int, int], RolloutOutcome] = {}

    def probe(
        self,
        plans: Sequence[RolloutPlan],
        starts: Sequence[StartState],
        *,
        steps: int = 60,
        measure_from: int | None = None,
        progress: StepProgress | None = None,
    ) -> PlanEffects:
        """Measure plans from common starts.

        Args:
            plans: stimulations of any number of units, or targets to hold.
            starts: common snapshots, restored bit-exactly before every roll-out.
            steps: control steps of stimulation.
            measure_from: first step that counts; by default the second half does.
            progress: called with (roll-outs done, roll-outs).

        Raises:
            WorkerError: a worker process died.
        """
        first = steps // 2 if measure_from is None else measure_from
        keys = [(fingerprint_start(start), steps, first) for start in starts]
        missing = [index for index, key in enumerate(keys) if key not in self._unperturbed]
        jobs: list[RolloutJob] = [(NO_STIMULATION, index) for index in missing]
        jobs += [(plan, index) for plan in plans for index in range(len(starts))]

        def report(done: int) -> None:
            if progress is not None:
                progress(done, len(jobs))

        outcomes = self._run(jobs, starts, steps, first, report)
        for index, outcome in zip(missing, outcomes, strict=False):
            self._unperturbed[keys[index]] = outcome
        unperturbed = np.array([self._unperturbed[key].means for key in keys])
        probed = outcomes[len(missing) :]
        shape = (len(plans), len(starts))
        means = np.array([outcome.means for outcome in probed]).reshape(*shape, unperturbed.shape[-1])
        return PlanEffects(
            effects=means - unperturbed,
            means=means,
            unperturbed=unperturbed,
            falls=np.array([outcome.fell for outcome in probed], np.bool_).reshape(shape),
            errors=np.array([outcome.error for outcome in probed], np.float64).reshape(shape),
        )

    def _run(
        self,
        jobs: Sequence[RolloutJob],
        starts: Sequence[StartState],
        steps: int,
        first: int,
        report: Callable[[int], None],
    ) -> list[RolloutOutcome]:
        """Run what the journal does not know yet, and let it know."""
        journal = self._journal
        if journal is None:
            return self.crew.run(jobs, starts, steps, first, report)
        keys = journal.keys(jobs, starts, steps, first)
        known = journal.read(keys)
        missing = [number for number, outcome in enumerate(known) if outcome is None]

        def keep(numbers: Sequence[int], outcomes: Sequence[RolloutOutcome]) -> None:
            journal.write([keys[missing[number]] for number in numbers], outcomes)

        fresh = iter(
            self.crew.run(
                [jobs[number] for number in missing],
                starts,
                steps,
                first,
                lambda done: report(len(jobs) - len(missing) + done),
                keep,
            )
        )
        self.crew.count([outcome for outcome in known if outcome is not None])
        return [next(fresh) if outcome is None else outcome for outcome in known]

    def sweep(
        self,
        units: Sequence[int],
        values: Sequence[float],
        starts: Sequence[StartState],
        *,
        steps: int = 60,
        progress: StepProgress | None = None,
    ) -> EffectCurves:
        """Overwrite each unit alone with each value: the effect curves of single units."""
        plans = [Stimulation((unit,), (value,)) for unit in units for value in values]
        result = self.probe(plans, starts, steps=steps, progress=progress)
        shape = (len(units), len(values), len(starts))
        return EffectCurves(
            units=tuple(units),
            values=tuple(values),
            effects=result.effects.reshape(*shape, -1),
            falls=result.falls.reshape(shape),
            unperturbed=result.unperturbed,
        )


@dataclass(frozen=True)
class EffectCurves:
    """Effect curves of N units at D values from K starts.

    Attributes:
        units: flat indices.
        values: the outputs v.
        effects: shape (N, D, K, J), as in `PlanEffects`.
        falls: shape (N, D, K).
        unperturbed: shape (K, J).
    """

    units: tuple[int, ...]
    values: tuple[float, ...]
    effects: Floats
    falls: NDArray[np.bool_]
    unperturbed: Floats

    def robust(self, column: int, sign: float) -> Floats:
        """The weakest effect in one direction over all starts, shape (N, D); 0 where the robot fell.

        Negative where at least one start went the other way.
        """
        weakest = np.min(sign * np.nan_to_num(self.effects[..., column]), axis=-1)
        result: Floats = np.where(self.falls.any(axis=-1), np.minimum(weakest, 0.0), weakest)
        return result

    def strength(self, column: int) -> Floats:
        """How far each unit moves an attribute, whichever way: its best value's robust effect, shape (N,)."""
        both = np.maximum(self.robust(column, 1.0), self.robust(column, -1.0))
        reach: Floats = np.maximum(both.max(axis=1), 0.0)
        return reach

    def reach(self, column: int, values: Sequence[float]) -> Floats:
        """How far each unit moves an attribute on average over the starts, at its best of some values.

        Unlike `strength` it does not ask for one sign from every start, so it ranks weak units too. A fall
        counts as no effect. Shape (N,).
        """
        doses = [self.values.index(value) for value in values]
        alive = np.where(self.falls, 0.0, np.nan_to_num(self.effects[..., column]))[:, doses]
        furthest: Floats = np.abs(alive.mean(axis=-1)).max(axis=1)
        return furthest

    def survived(self, unit: int) -> float:
        """The largest |v| of a unit up to which the robot never fell, 0 if there is none."""
        row = self.units.index(unit)
        alive = 0.0
        for value in sorted({abs(value) for value in self.values}):
            columns = [number for number, v in enumerate(self.values) if abs(v) == value]
            if self.falls[row, columns].any():
                break
            alive = value
        return alive


def bootstrap_interval(
    samples: NDArray[Any], seed: int, *, level: float = 0.95, draws: int = 2000
) -> tuple[float, float]:
    """Percentile bootstrap interval of a mean.

    Args:
        samples: shape (K,); NaN (a fall before the measured steps) is left out.
        seed: of the draws.
        level: coverage.
        draws: resamples.

    Returns:
        low and high; NaN for fewer than two samples, which say nothing about spread.
    """
    known = np.asarray(samples, np.float64)
    known = known[np.isfinite(known)]
    if known.size < 2:
        return float("nan"), float("nan")
    drawn = stats.bootstrap(
        (known,), np.mean, n_resamples=draws, confidence_level=level, method="percentile", rng=seed
    ).confidence_interval
    return float(drawn.low), float(drawn.high)
