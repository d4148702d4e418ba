"""Several stimulated roll-outs of one robot and policy: in lock step where they can be, else one by one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, wrap_angles
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.intervention_rollout_plan import InterventionRolloutPlan
from pdtui.probing.lockstep_rollouts import FEWEST_TOGETHER, LockstepRollouts, make_lockstep_rollouts
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import (
    PidStimulationPlan,
    RolloutJob,
    RolloutOutcome,
    RolloutPlan,
    StimulationController,
    run_rollout,
)
from pdtui.robots.robot import Robot


def run_rollouts(
    robot: Robot,
    policy: Policy,
    starts: Mapping[int, StartState],
    jobs: Sequence[RolloutJob],
    steps: int,
    measure_from: int,
) -> list[RolloutOutcome]:
    """Run roll-outs as `run_rollout` does, and return their outcomes in the order of the jobs.

    Those that overwrite units by constants, or by what a controller says, run in lock step if robot and
    policy offer that; their figures are then the same to rounding.
    """
    found: dict[int, RolloutOutcome] = {}
    together = [number for number, (plan, _) in enumerate(jobs) if plan_only_overwrites(plan)]
    lockstep = make_lockstep_rollouts(robot, policy, len(together))
    if lockstep is not None:
        worlds: dict[Hashable, list[int]] = defaultdict(list)
        for number in together:
            worlds[lockstep.world_id(starts[jobs[number][1]].snapshot)].append(number)
        for numbers in worlds.values():
            if len(numbers) >= FEWEST_TOGETHER:
                measured = _measure_together(
                    lockstep,
                    robot,
                    [starts[jobs[number][1]] for number in numbers],
                    [jobs[number][0] for number in numbers],
                    steps,
                    measure_from,
                )
                found.update(zip(numbers, measured, strict=True))
    for number, (plan, start) in enumerate(jobs):
        if number not in found:
            found[number] = run_rollout(robot, policy, starts[start], plan, steps, measure_from)
    return [found[number] for number in range(len(jobs))]


def plan_only_overwrites(plan: RolloutPlan) -> bool:
    """Return whether a plan overwrites units by numbers, and nothing else."""
    if isinstance(plan, InterventionRolloutPlan):
        return False
    return not (plan.units if isinstance(plan, PidStimulationPlan) else plan).edits


class _BatchMeasurement:
    """What `RolloutOutcome` measures, of n roll-outs at once."""

    def __init__(self, robot: Robot, before: Floats, measure_from: int) -> None:
        self._angles = np.array([attribute.wraps for attribute in robot.attributes])
        self._previous, self._measure_from = before, measure_from
        self._turned, self._total = np.zeros_like(before), np.zeros_like(before)
        self._counted = np.zeros(len(before), np.intp)
        self.survived = np.zeros(len(before), np.intp)

    def add(self, step: int, rows: NDArray[np.intp], attributes: Floats) -> None:
        """Measure the attributes after a control step of some of the roll-outs."""
        values = attributes[rows]
        self.survived[rows] += 1
        change = (values - self._previous[rows])[:, self._angles]
        self._turned[np.ix_(rows, self._angles)] += wrap_angles(change)
        self._previous[rows] = values
        if step >= self._measure_from:
            self._total[rows] += np.where(self._angles, self._turned[rows], values)
            self._counted[rows] += 1

    def means(self) -> Floats:
        """Return the mean of each attribute over the measured steps, shape (n, J); NaN without any."""
        counted = np.where(self._counted, self._counted, np.nan)
        means: Floats = self._total / counted[:, None]
        return means


def _measure_together(
    lockstep: LockstepRollouts,
    robot: Robot,
    starts: Sequence[StartState],
    plans: Sequence[RolloutPlan],
    steps: int,
    measure_from: int,
) -> list[RolloutOutcome]:
    before = lockstep.restore([start.snapshot for start in starts])
    measurement = _BatchMeasurement(robot, before, measure_from)
    fixed = [plan if isinstance(plan, Stimulation) else Stimulation() for plan in plans]
    controllers = {
        row: StimulationController(plan, robot, before[row])
        for row, plan in enumerate(plans)
        if isinstance(plan, PidStimulationPlan)
    }
    errors = np.zeros((len(plans), 2))  # sums of distances from the target, and their number

    def stimulate(_step: int, attributes: Floats) -> Sequence[Stimulation]:
        if not controllers:
            return fixed
        return [
            controllers[row].stimulate(attributes[row]) if row in controllers else plan
            for row, plan in enumerate(fixed)
        ]

    def watch(step: int, rows: NDArray[np.intp], attributes: Floats) -> None:
        measurement.add(step, rows, attributes)
        if step >= measure_from:
            for row in rows.tolist():
                if row in controllers:
                    errors[row] += controllers[row].distance(attributes[row]), 1.0

    outcomes = lockstep.run(stimulate, steps, watch)
    survived = measurement.survived.tolist()
    return [
        RolloutOutcome(means, total / count if count else float("nan"), steps_survived, outcome)
        for means, (total, count), steps_survived, outcome in zip(
            measurement.means(), errors.tolist(), survived, outcomes, strict=True
        )
    ]
