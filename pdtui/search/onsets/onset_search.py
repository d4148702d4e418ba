"""Search for the phase of the gait at which a behavior should begin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots.task import TaskVerdict
from pdtui.search.onsets.gait_signals import find_gait_marks
from pdtui.search.task_rollout import StimulationWithDuration
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.stimulation.interventions.intervention import Onset

JudgePlans = Callable[[Sequence[StimulationWithDuration], Sequence[int]], list[list[TaskVerdict]]]
"""Returns the verdicts of each plan on each seed."""
_MARKS, _PHASES = 2, 8
"""Signals of the gait that are tried, and delays after a moment of each, over one cycle."""
_WALKS, _WALKED_STEPS, _SKIPPED = 3, 1000, 100
"""Walks from which signals are chosen, control steps of each, and steps at their starts that are left out."""


def search_onset(
    pool: RolloutPool,
    plan: StimulationWithDuration,
    seeds: Sequence[int],
    fresh: Sequence[int],
    judge: JudgePlans,
    *,
    start: str = "",
) -> StimulationWithDuration:
    """Return the plan with the onset that does a task on most walks, or as it is if none does better.

    The best onset is chosen on some walks, and is kept only if it does better than none on others.

    Args:
        pool: Whose robot walks.
        plan: The plan, which begins at once.
        seeds: Seeds of the walks on which an onset is chosen.
        fresh: Seeds of the walks on which it is compared with none.
        judge: Runs the roll-outs.
        start: State in which the walks begin; empty for the robot's usual one.
    """
    robot = pool.robot
    episodes = monitor_episodes(robot, pool.policy, seeds[:_WALKS], _WALKED_STEPS, start=start)
    walks = [episode.attributes[_SKIPPED:] for episode in episodes if episode.steps > _SKIPPED]
    plans = [
        replace(plan, onset=Onset(mark, round(number * length / _PHASES, 3)))
        for mark, length in find_gait_marks(walks, robot.attributes, robot.control_dt, _MARKS)
        for number in range(_PHASES)
    ]
    if not plans:
        return plan
    best = max(zip(judge(plans, seeds), plans, strict=True), key=lambda pair: _count(pair[0]))[1]
    with_onset, without = judge([best, plan], fresh)
    return best if _count(with_onset) > _count(without) else plan


def _count(verdicts: Sequence[TaskVerdict]) -> tuple[int, float]:
    """Return the successes; scores decide between equals."""
    return sum(one.success for one in verdicts), sum(one.score for one in verdicts)
