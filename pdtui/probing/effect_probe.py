"""Step 5, probe: stimulate from common starts and compare with the unperturbed roll-outs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.outcome import is_failure
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.measured_effects import PlanEffects, SingleUnitEffects, UnitEffects
from pdtui.probing.rollout_journal import RolloutJournal, fingerprint_start_state
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome, RolloutPlan


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
            falls=np.array([is_failure(one.outcome) for one in probed], np.bool_).reshape(shape),
            errors=np.array([outcome.error for outcome in probed], np.float64).reshape(shape),
            unperturbed_falls=np.array(
                [is_failure(self._unperturbed[key].outcome) for key in keys], np.bool_
            ),
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
            unperturbed_falls=result.unperturbed_falls,
        )

    def measure_outputs(
        self,
        outputs: Sequence[tuple[int, float]],
        starts: Sequence[StartState],
        *,
        steps: int,
        measure_from: int | None = None,
        progress: StepProgress | None = None,
    ) -> SingleUnitEffects:
        """Hold single units at outputs of their own, and measure them as `measure_plans` does."""
        rows = {output: row for row, output in enumerate(dict.fromkeys(outputs))}
        plans = [Stimulation((unit,), (value,)) for unit, value in rows]
        result = self.measure_plans(plans, starts, steps=steps, measure_from=measure_from, progress=progress)
        return SingleUnitEffects(rows, result)

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
