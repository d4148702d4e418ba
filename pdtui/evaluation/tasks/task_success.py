"""The success of behaviors in their tasks, in each condition, and of what stands in for their units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from pdtui.core.outcome import OutcomeCounts, count_outcomes
from pdtui.evaluation.disturbance_conditions import UNDISTURBED
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.paired_statistics import holm_correction, share_interval, sign_flip_p_value
from pdtui.evaluation.tasks.task_runs import TaskRunKey, TaskRunResult
from pdtui.robots.task import average_figures
from pdtui.stimulation.stimulation_map import Behavior

TaskResults = Mapping[TaskRunKey, TaskRunResult]


@dataclass(frozen=True)
class TaskSubstituteSuccess:
    """How a substitute for the behavior's units did in the task, on seeds on which the behavior was run, too.

    Attributes:
        kind: ``random units``, ``random directions`` or ``actions``.
        draws: Number of draws; 1 for a push on the actions.
        seeds: Number of seeds of each draw.
        as_good: Draws that succeed on at least as many of these seeds as the behavior.
        low, high: 95 % interval of the share `as_good` of `draws` (Clopper and Pearson).
        done: Runs with success, of `draws` × `seeds`.
        own_done: Number of these seeds on which the behavior succeeds.
        outcomes: How runs ended before their time, of `draws` × `seeds`.
    """

    kind: str
    draws: int
    seeds: int
    as_good: int
    low: float
    high: float
    done: int
    own_done: int
    outcomes: OutcomeCounts


@dataclass(frozen=True)
class TaskEvaluation:
    """The success of one behavior over the seeds of one condition.

    Attributes:
        behavior, task: Their names.
        condition: Name of the condition.
        after: Name of the behavior that is done before; empty for the task's own start.
        wanted: What counts as success.
        runs: Number of seeds; after another behavior, those on which it succeeds and the robot stays up.
        done: Number of seeds with success with the behavior.
        low, high: 95 % interval of that share (Clopper and Pearson).
        by_itself: Number of seeds with success without it.
        p_value: That of a paired sign-flip test of the successes, which is McNemar's.
        corrected: The same, corrected over the undisturbed or over the disturbed rows.
        holds: Whether it succeeds more often than by itself, and `corrected` is below the level.
        still_done: Number of seeds on which it also succeeds at the end of a long hold; None for a behavior
            with a period, and for a disturbed condition.
        outcomes: How runs with the behavior ended before their time, in the task or in the long hold.
        outcomes_by_itself: How those without it did.
        seed_done: Whether each seed succeeds with the behavior, in the order of the seeds.
        seed_scores: How near each seed comes to that, by the task's judge.
        figures: The task's measures with the behavior, means over seeds.
        figures_by_itself: The same without it.
        substitutes: How random units, random directions and a push on the actions did; empty for a disturbed
            condition, and for a behavior that overwrites no units.
    """

    behavior: str
    task: str
    condition: str
    after: str
    wanted: str
    runs: int
    done: int
    low: float
    high: float
    by_itself: int
    p_value: float
    corrected: float
    holds: bool
    still_done: int | None
    outcomes: OutcomeCounts
    outcomes_by_itself: OutcomeCounts
    seed_done: tuple[bool, ...]
    seed_scores: tuple[float, ...]
    figures: dict[str, float]
    figures_by_itself: dict[str, float]
    substitutes: tuple[TaskSubstituteSuccess, ...] = ()


def summarize_tasks(plan: EvaluationPlan, results: TaskResults) -> tuple[TaskEvaluation, ...]:
    """Summarize the runs of every task in each condition, the undisturbed rows first.

    P-values are corrected over the undisturbed rows, and over the disturbed ones.
    """
    rows: list[TaskEvaluation] = []
    disturbed = [name for name in plan.conditions if name != UNDISTURBED.name]
    for table in ([UNDISTURBED.name], disturbed):
        found = [_summarize(plan, behavior, name, results) for name in table for behavior in plan.tasked]
        if UNDISTURBED.name in table:
            follows = dict.fromkeys((run.behavior, run.after) for run in results if run.after)
            behaviors = plan.loop.map.behaviors
            found += [
                _summarize(plan, behaviors[name], UNDISTURBED.name, results, after) for name, after in follows
            ]
        corrected = holm_correction([row.p_value for row in found])
        rows += [
            replace(row, corrected=p, holds=p < plan.settings.level and row.done > row.by_itself)
            for row, p in zip(found, corrected, strict=True)
        ]
    return tuple(rows)


def _summarize(
    plan: EvaluationPlan, behavior: Behavior, condition: str, results: TaskResults, after: str = ""
) -> TaskEvaluation:
    own = {
        run: one
        for run, one in results.items()
        if (run.behavior, run.condition, run.after) == (behavior.name, condition, after) and one.reached_press
    }
    task = plan.loop.robot.find_task(behavior.task)
    pressed = [one for run, one in own.items() if run.pressed and run.kind == "units"]
    untouched = [one for run, one in own.items() if not run.pressed]
    done = [one.verdict.success for one in pressed]
    by_itself = [one.verdict.success for one in untouched]
    p_value = sign_flip_p_value(np.subtract(done, by_itself, dtype=np.float64))
    low, high = share_interval(sum(done), len(done))
    return TaskEvaluation(
        behavior=behavior.name,
        task=task.name,
        condition=condition,
        after=after,
        wanted=task.wanted,
        runs=len(done),
        done=sum(done),
        low=low,
        high=high,
        by_itself=sum(by_itself),
        p_value=p_value,
        corrected=p_value,
        holds=False,
        still_done=_count_still_done(pressed),
        outcomes=_count(plan, pressed),
        outcomes_by_itself=_count(plan, untouched),
        seed_done=tuple(done),
        seed_scores=tuple(one.verdict.score for one in pressed),
        figures=average_figures(one.verdict for one in pressed),
        figures_by_itself=average_figures(one.verdict for one in untouched),
        substitutes=_summarize_substitutes(plan, done, own),
    )


def _count(plan: EvaluationPlan, results: Iterable[TaskRunResult]) -> OutcomeCounts:
    return count_outcomes((one.outcome for one in results), plan.loop.robot.outcomes)


def _summarize_substitutes(
    plan: EvaluationPlan, done: Sequence[bool], own: TaskResults
) -> tuple[TaskSubstituteSuccess, ...]:
    kinds: dict[str, dict[int, list[TaskRunResult]]] = {}
    for run, one in own.items():
        if run.kind != "units":
            kinds.setdefault(run.kind, {}).setdefault(run.draw, []).append(one)
    figures = []
    for kind, draws in kinds.items():
        seeds = len(draws[0])
        successes = [sum(one.verdict.success for one in drawn) for drawn in draws.values()]
        own_done = sum(done[:seeds])
        as_good = sum(count >= own_done for count in successes)
        low, high = share_interval(as_good, len(draws))
        outcomes = _count(plan, chain.from_iterable(draws.values()))
        figures.append(
            TaskSubstituteSuccess(
                kind, len(draws), seeds, as_good, low, high, sum(successes), own_done, outcomes
            )
        )
    return tuple(figures)


def _count_still_done(pressed: Sequence[TaskRunResult]) -> int | None:
    held = [one.still for one in pressed if one.still is not None]
    return sum(one.success for one in held) if held else None
