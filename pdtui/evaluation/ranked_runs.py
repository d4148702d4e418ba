"""The best, the median and the worst run of each behavior, to be looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pdtui.evaluation.behavior_evaluation import MapEvaluation
from pdtui.evaluation.disturbance_conditions import UNDISTURBED
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.held_run import HeldRunPlan
from pdtui.evaluation.protocol_settings import RunTimes, plan_run_times
from pdtui.evaluation.tasks.task_success import TaskEvaluation
from pdtui.search.task_rollout import count_walk_steps


@dataclass(frozen=True)
class RankedRun:
    """A run in the robot's own world, and how it was judged.

    Attributes:
        behavior: Name of the behavior.
        criterion: What the run must show.
        rank: ``best``, ``median`` or ``worst``.
        met: Whether it shows that.
        plan: The run.
    """

    behavior: str
    criterion: str
    rank: str
    met: bool
    plan: HeldRunPlan


def rank_runs(plan: EvaluationPlan, result: MapEvaluation) -> list[RankedRun]:
    """Return three runs of each behavior: first those with an aim, then those with a task."""
    ranked = []
    for row in result.undisturbed():
        effects = [row.wanted * effect for effect in row.seed_effects]
        for rank, place in _pick_seeds(row.seed_met, effects).items():
            seed = plan.seeds[place]
            run = HeldRunPlan(row.behavior, seed, plan.times(row.behavior, seed))
            ranked.append(RankedRun(row.behavior, row.criterion, rank, row.seed_met[place], run))
    for task in (row for row in result.tasks if row.condition == UNDISTURBED.name and not row.after):
        for rank, place in _pick_seeds(task.seed_done, task.seed_scores).items():
            run = _plan_task_run(plan, task, plan.seeds[place])
            ranked.append(RankedRun(task.behavior, task.wanted, rank, task.seed_done[place], run))
    return ranked


def _pick_seeds(met: Sequence[bool], scores: Sequence[float]) -> dict[str, int]:
    """Return the positions of three seeds, ranked by whether they meet the criterion, then by score."""
    order = sorted(range(len(met)), key=lambda one: (met[one], scores[one]), reverse=True)
    return {"best": order[0], "median": order[len(order) // 2], "worst": order[-1]}


def _plan_task_run(plan: EvaluationPlan, row: TaskEvaluation, seed: int) -> HeldRunPlan:
    task, dt = plan.loop.robot.find_task(row.task), plan.loop.robot.control_dt
    bin_steps = plan_run_times(plan.settings, seed, dt).bin
    times = RunTimes(count_walk_steps(task, seed), task.steps, 0, task.steps, bin_steps, dt)
    return HeldRunPlan(row.behavior, seed, times, start=task.start)
