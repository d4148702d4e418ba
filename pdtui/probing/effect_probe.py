"""Step 5, probe: stimulate from common starts and compare with the unperturbed roll-outs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.core.worker_pool import StepProgress
from pdtui.probing.rollout_journal import RolloutJournal, fingerprint_start_state
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, RolloutPlan


@dataclass(frozen=True)
class PlanEffects:
    """Effects of S plans from each of K starts on J attributes.

    Attributes:
        effects: change of each attribute against the unperturbed roll-out from the same start, in its unit,
            shape (S, K, J): a difference of means over the measured steps; for an angle, of its mean change
            since the start. NaN where the robot fell before the measured steps.
        means: the means with stimulation, shape (S, K, J).
        unperturbed: the means without stimulation, shape (K, J).
        falls: whether the robot fell, shape (S, K).
        errors: mean distance from the target for plans with a controller, else NaN, shape (S, K).
    """

    effects: Floats
    means: Floats
    unperturbed: Floats
    falls: NDArray[np.bool_]
    errors: Floats


@dataclass(frozen=True)
class UnitEffects:
    """Effects of N units, overwritten with D values from K starts, on J attributes.

    Attributes:
        units: flat indices of the units.
        values: the values v with which each unit is overwritten.
        effects: change of each attribute against the unperturbed roll-out, shape (N, D, K, J), as in
            `PlanEffects`.
        falls: whether the robot fell, shape (N, D, K).
        unperturbed: means of the attributes without stimulation, shape (K, J).
    """

    units: tuple[int, ...]
    values: tuple[float, ...]
    effects: Floats
    falls: NDArray[np.bool_]
    unperturbed: Floats

    def robust_effects(self, column: int, sign: float) -> Floats:
        """Return the weakest effect over all starts in the direction of `sign`, shape (N, D).

        It is negative where the effect from a start has the other sign, and at most 0 where the robot fell.
        """
        weakest = np.min(sign * np.nan_to_num(self.effects[..., column]), axis=-1)
        return np.asarray(np.where(self.falls.any(axis=-1), np.minimum(weakest, 0.0), weakest))

    def robust_strengths(self, column: int) -> Floats:
        """Return the largest robust effect of each unit over its values and both directions, shape (N,)."""
        both = np.maximum(self.robust_effects(column, 1.0), self.robust_effects(column, -1.0))
        return np.asarray(np.maximum(both.max(axis=1), 0.0))

    def mean_strengths(self, column: int, values: Sequence[float]) -> Floats:
        """Return the largest mean effect of each unit over the starts, in size, at some values, shape (N,).

        Unlike `robust_strengths` it does not require one sign from every start, so it ranks weak units too.
        A fall counts as no effect.
        """
        doses = [self.values.index(value) for value in values]
        effects = np.where(self.falls, 0.0, np.nan_to_num(self.effects[..., column]))[:, doses]
        return np.asarray(np.abs(effects.mean(axis=-1)).max(axis=1))

    def safe_magnitude(self, unit: int) -> float:
        """Return the largest |v| of a unit up to which the robot never fell; 0 if there is none."""
        row = self.units.index(unit)
        falls = zip(self.values, self.falls[row].any(axis=-1), strict=True)
        lowest_fall = min((abs(value) for value, fell in falls if fell), default=np.inf)
        return max((abs(value) for value in self.values if abs(value) < lowest_fall), default=0.0)


class EffectProbe:
    """Measures the effects of stimulations, and remembers the unperturbed roll-outs that all of them need.

    Finished roll-outs that the journal holds are not run again.
    """

    def __init__(self, pool: RolloutPool, journal: RolloutJournal | None = None) -> None:
        self.pool, self._journal = pool, journal
        self._unperturbed: dict[tuple[bytes, int, int], RolloutOutcome] = {}

    def measure_plans(
        self,
        plans: Sequence[RolloutPlan],
        starts: Sequence[StartState],
        *,
        steps: int = 60,
        measure_from: int | None = None,
        progress: StepProgress | None = None,
    ) -> PlanEffects:
        """Measure plans from common starts.

        Before each roll-out robot and policy are restored to its start, bit for bit. By default the second
        half of the steps is measured.

        Raises:
            WorkerError: a worker process died.
        """
        first = steps // 2 if measure_from is None else measure_from
        keys = [(fingerprint_start_state(start), steps, first) for start in starts]
        missing = [index for index, key in enumerate(keys) if key not in self._unperturbed]
        jobs: list[RolloutJob] = [(NO_STIMULATION, index) for index in missing]
        jobs += [(plan, index) for plan in plans for index in range(len(starts))]
        outcomes = self._run(jobs, starts, steps, first, progress)
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

    def measure_units(
        self,
        units: Sequence[int],
        values: Sequence[float],
        starts: Sequence[StartState],
        *,
        steps: int = 60,
        progress: StepProgress | None = None,
    ) -> UnitEffects:
        """Overwrite each unit alone with each value, and measure it as `measure_plans` does."""
        plans = [Stimulation((unit,), (value,)) for unit in units for value in values]
        result = self.measure_plans(plans, starts, steps=steps, progress=progress)
        shape = (len(units), len(values), len(starts))
        return UnitEffects(
            units=tuple(units),
            values=tuple(values),
            effects=result.effects.reshape(*shape, -1),
            falls=result.falls.reshape(shape),
            unperturbed=result.unperturbed,
        )

    def _run(
        self,
        jobs: Sequence[RolloutJob],
        starts: Sequence[StartState],
        steps: int,
        measure_from: int,
        progress: StepProgress | None,
    ) -> list[RolloutOutcome]:
        """Run the roll-outs that the journal does not hold, and add them to it."""
        journal = self._journal
        keys = [] if journal is None else journal.keys(jobs, starts, steps, measure_from)
        stored = [] if journal is None else journal.read(keys)
        known = {number: outcome for number, outcome in enumerate(stored) if outcome is not None}
        missing = [number for number in range(len(jobs)) if number not in known]
        self.pool.count_rollouts(known.values())

        def keep(indices: Sequence[int], batch: Sequence[RolloutOutcome]) -> None:
            numbers = [missing[index] for index in indices]
            known.update(zip(numbers, batch, strict=True))
            if journal is not None:
                journal.write([keys[number] for number in numbers], batch)
            if progress is not None:
                progress(len(known), len(jobs))

        self.pool.run([jobs[number] for number in missing], starts, steps, measure_from, keep)
        return [known[number] for number in range(len(jobs))]
