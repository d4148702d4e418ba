"""Step 5, probe: stimulate from common snapshots, and measure against the unperturbed roll-out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.rollout_journal import RolloutJournal, fingerprint_start_state
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, RolloutPlan
from pdtui.probing.unit_effects import UnitEffects
from pdtui.spectra.monitor import StepProgress


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


class EffectProbe:
    """Measures stimulations; remembers the unperturbed roll-outs, which every comparison needs again.

    Args:
        pool: runs the roll-outs.
        journal: remembers them on disk, and those of a run that was interrupted.
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
        keys = [(fingerprint_start_state(start), steps, first) for start in starts]
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
            return self.pool.run(jobs, starts, steps, first, report)
        keys = journal.keys(jobs, starts, steps, first)
        known = journal.read(keys)
        missing = [number for number, outcome in enumerate(known) if outcome is None]

        def keep(numbers: Sequence[int], outcomes: Sequence[RolloutOutcome]) -> None:
            journal.write([keys[missing[number]] for number in numbers], outcomes)

        fresh = iter(
            self.pool.run(
                [jobs[number] for number in missing],
                starts,
                steps,
                first,
                lambda done: report(len(jobs) - len(missing) + done),
                keep,
            )
        )
        self.pool.count([outcome for outcome in known if outcome is not None])
        return [next(fresh) if outcome is None else outcome for outcome in known]

    def measure_units(
        self,
        units: Sequence[int],
        values: Sequence[float],
        starts: Sequence[StartState],
        *,
        steps: int = 60,
        progress: StepProgress | None = None,
    ) -> UnitEffects:
        """Overwrite each unit alone with each value: the effect curves of single units."""
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
