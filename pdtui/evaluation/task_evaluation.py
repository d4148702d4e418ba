"""The success of behaviors in their tasks: each seed is driven with the behavior and without it.

A behavior that lasts until it is released is also held for as long as one with an aim, and the task's judge
sees the last part of that hold, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import unwrap_angles
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import run_episode
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.paired_statistics import holm_correction, share_interval, sign_flip_p_value
from pdtui.evaluation.protocol_settings import plan_run_times
from pdtui.evaluation.substitute_pushes import RandomUnits, act_in_place, draw_random_units
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict, average_figures
from pdtui.search.task_rollout import count_walk_steps
from pdtui.stimulation.stimulation_map import Behavior


@dataclass(frozen=True)
class TaskEvaluation:
    """The success of one behavior over all seeds.

    Attributes:
        behavior, task: Their names.
        wanted: What counts as success.
        runs: Number of seeds.
        done: Number of seeds with success with the behavior.
        low, high: 95 % interval of that share (Clopper and Pearson).
        by_itself: Number of seeds with success without it.
        p_value: That of a paired sign-flip test of the successes, which is McNemar's.
        corrected: The same, corrected over the rows of the table.
        holds: Whether it succeeds more often than by itself, and `corrected` is below the level.
        still_done: Number of seeds on which it also succeeds at the end of a long hold; None for a behavior
            with a period.
        falls: Number of seeds on which the robot fell with the behavior, in the task or in the long hold.
        falls_by_itself: Number of seeds on which it fell without it.
        draws: Number of draws of as many random units with the same outputs.
        draw_seeds: Number of seeds of each draw.
        as_good: Draws that succeed on at least as many of these seeds as the behavior.
        figures: The task's measures with the behavior, means over seeds.
        figures_by_itself: The same without it.
    """

    behavior: str
    task: str
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
    falls: int
    falls_by_itself: int
    draws: int
    draw_seeds: int
    as_good: int
    figures: dict[str, float]
    figures_by_itself: dict[str, float]


@dataclass(frozen=True)
class TaskRunResult:
    """The verdict on one run, that on the end of a long hold, and whether the robot fell."""

    verdict: TaskVerdict
    fell: bool
    still: TaskVerdict | None = None


class TaskRun(NamedTuple):
    """One run of a task.

    Attributes:
        behavior: Name of the behavior.
        seed: Seed of the run.
        pressed: Whether the behavior is pressed.
        steps: Control steps from the press on.
        units: Random units in the place of the behavior's; None for its own.
        draw: Number of the draw of these units.
    """

    behavior: str
    seed: int
    pressed: bool
    steps: int
    units: RandomUnits | None = None
    draw: int = 0


def list_task_runs(plan: EvaluationPlan) -> list[TaskRun]:
    """Return the runs of all tasks."""
    runs = []
    for behavior in plan.tasked:
        task = plan.loop.robot.find_task(behavior.task)
        dt = plan.loop.robot.control_dt
        held = max(task.steps, plan_run_times(plan.settings, 0, dt).held)
        steps = task.steps if behavior.period is not None else held
        runs += [TaskRun(behavior.name, seed, True, steps) for seed in plan.seeds]
        runs += [TaskRun(behavior.name, seed, False, task.steps) for seed in plan.seeds]
        runs += _list_random_runs(plan, behavior, task)
    return runs


def _list_random_runs(plan: EvaluationPlan, behavior: Behavior, task: Task) -> list[TaskRun]:
    outputs = plan.outputs(behavior)
    if not outputs.units:
        return []
    drawn = [
        draw_random_units(outputs, plan.loop.policy.layers, behavior.name, draw)
        for draw in range(plan.settings.draws)
    ]
    seeds = plan.seeds[: plan.settings.draw_seeds]
    return [
        TaskRun(behavior.name, seed, True, task.steps, units, draw)
        for draw, units in enumerate(drawn)
        for seed in seeds
    ]


def count_task_steps(plan: EvaluationPlan, run: TaskRun) -> int:
    """Return how many control steps a run of a task has; a fall makes it fewer."""
    task = plan.loop.robot.find_task(plan.loop.map.behaviors[run.behavior].task)
    return count_walk_steps(task, run.seed) + run.steps


def run_task_episode(built: ControlLoop, run: TaskRun) -> TaskRunResult:
    """Run a behavior's task once through the control loop, as in a drive.

    Raises:
        MapError: The robot has no such task.
    """
    task = built.robot.find_task(built.map.behaviors[run.behavior].task)
    loop = ControlLoop(built.robot, built.policy, built.map, run.seed, start=task.start)
    loop.act = act_in_place(loop.act, built.policy, built.robot, run.units)
    walk = count_walk_steps(task, run.seed)

    def press(step: int) -> list[DriveEvent]:
        return [DriveEvent(step, "behavior", run.behavior)] if step == walk and run.pressed else []

    before = loop.attributes
    records = list(run_episode(loop, walk + run.steps, press))
    rows = np.array([before, *(record.attributes for record in records)])
    fell = records[-1].fell
    if len(rows) <= walk + 1:
        return TaskRunResult(TaskVerdict(False, 0.0, {}), fell)
    attributes = loop.robot.attributes
    after = unwrap_angles(rows[walk + 1 :], attributes)
    at_once = after[: task.steps]
    fell_at_once = fell and len(after) <= task.steps
    verdict = task.judge(TaskRunTrace(attributes, rows[: walk + 1], at_once, fell_at_once))
    if run.steps == task.steps:
        return TaskRunResult(verdict, fell)
    whole = not fell and len(after) == run.steps
    still = task.judge(TaskRunTrace(attributes, rows[: walk + 1], after[-task.steps :], not whole))
    return TaskRunResult(verdict, fell, still)


def summarise_tasks(
    plan: EvaluationPlan, results: Mapping[TaskRun, TaskRunResult]
) -> tuple[TaskEvaluation, ...]:
    """Summarise the runs of every task, with p-values corrected over them."""
    rows = [
        _summarise_task(
            behavior,
            plan.loop.robot.find_task(behavior.task),
            {run: result for run, result in results.items() if run.behavior == behavior.name},
        )
        for behavior in plan.tasked
    ]
    corrected = holm_correction([row.p_value for row in rows])
    return tuple(
        replace(row, corrected=p, holds=p < plan.settings.level and row.done > row.by_itself)
        for row, p in zip(rows, corrected, strict=True)
    )


def _summarise_task(
    behavior: Behavior, task: Task, results: Mapping[TaskRun, TaskRunResult]
) -> TaskEvaluation:
    pressed = [one for run, one in results.items() if run.pressed and run.units is None]
    untouched = [one for run, one in results.items() if not run.pressed]
    draws: dict[int, list[bool]] = {}
    for run, one in results.items():
        if run.units is not None:
            draws.setdefault(run.draw, []).append(one.verdict.success)
    done = [one.verdict.success for one in pressed]
    by_itself = [one.verdict.success for one in untouched]
    draw_seeds = len(draws[0]) if draws else 0
    p_value = sign_flip_p_value(np.subtract(done, by_itself, dtype=np.float64))
    low, high = share_interval(sum(done), len(done))
    return TaskEvaluation(
        behavior=behavior.name,
        task=task.name,
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
        falls=sum(one.fell for one in pressed),
        falls_by_itself=sum(one.fell for one in untouched),
        draws=len(draws),
        draw_seeds=draw_seeds,
        as_good=sum(sum(drawn) >= sum(done[:draw_seeds]) for drawn in draws.values()),
        figures=average_figures(one.verdict for one in pressed),
        figures_by_itself=average_figures(one.verdict for one in untouched),
    )


def _count_still_done(pressed: Sequence[TaskRunResult]) -> int | None:
    held = [one.still for one in pressed if one.still is not None]
    return sum(one.success for one in held) if held else None
