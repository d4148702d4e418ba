"""The runs of tasks in an evaluation: through the control loop, as in a drive, and judged.

Each seed is driven with the behavior and without it. A behavior that lasts until it is released is also held
for as long as one with an aim, and the task's judge sees the last part of that hold, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import unwrap_angles
from pdtui.driving.control_loop import ControlLoop
from pdtui.evaluation.evaluation_plan import MEASURED_SEEDS, EvaluationPlan, SubstituteKind
from pdtui.evaluation.held_run import HeldRunPlan, PushMeasurement, begin_held_run
from pdtui.evaluation.protocol_settings import RunTimes, plan_run_times
from pdtui.evaluation.run_conditions import UNDISTURBED, find_condition
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict
from pdtui.search.task_rollout import count_walk_steps
from pdtui.stimulation.stimulation_map import Behavior


class TaskRun(NamedTuple):
    """One run of a task.

    Attributes:
        behavior: Name of the behavior.
        seed: Seed of the run.
        pressed: Whether the behavior is pressed.
        steps: Control steps from the press on.
        condition: Name of the condition.
        kind: What is pushed.
        draw: Number of the draw of a random kind.
    """

    behavior: str
    seed: int
    pressed: bool
    steps: int
    condition: str = UNDISTURBED.name
    kind: SubstituteKind = "units"
    draw: int = 0


@dataclass(frozen=True)
class TaskEpisode:
    """A run of a task with everything that it takes to run it."""

    run: TaskRun
    plan: HeldRunPlan


@dataclass(frozen=True)
class TaskRunResult:
    """The verdict on one run, that on the end of a long hold, and whether the robot fell."""

    verdict: TaskVerdict
    fell: bool
    still: TaskVerdict | None = None


def list_task_runs(plan: EvaluationPlan) -> list[TaskRun]:
    """Return the runs of all tasks; only those in the robot's own world include a long hold."""
    runs = []
    for behavior in plan.tasked:
        name, task = behavior.name, plan.loop.robot.find_task(behavior.task)
        held = max(task.steps, plan_run_times(plan.settings, 0, plan.loop.robot.control_dt).held)
        for condition in plan.conditions:
            long = condition == UNDISTURBED.name and behavior.period is None
            seeds = plan.seeds_of(condition)
            runs += [TaskRun(name, seed, True, held if long else task.steps, condition) for seed in seeds]
            runs += [TaskRun(name, seed, False, task.steps, condition) for seed in seeds]
        runs += [
            TaskRun(name, seed, True, task.steps, UNDISTURBED.name, kind, draw)
            for kind, draws in plan.substitutes_of(behavior)
            for draw in range(draws)
            for seed in plan.seeds[: plan.settings.draw_seeds]
        ]
    return runs


def count_task_steps(plan: EvaluationPlan, run: TaskRun) -> int:
    """Return how many control steps a run of a task has; a fall makes it fewer."""
    task = plan.loop.robot.find_task(plan.loop.map.behaviors[run.behavior].task)
    return count_walk_steps(task, run.seed) + run.steps


def task_measuring_runs(plan: EvaluationPlan) -> list[HeldRunPlan]:
    """Return the runs that measure how far behaviors with a task move units and actions.

    They begin as the task does, and end after the period or, if it is shorter, the first window.
    """
    runs = []
    for behavior in plan.tasked:
        if not plan.outputs(behavior).units:
            continue
        task, dt = plan.loop.robot.find_task(behavior.task), plan.loop.robot.control_dt
        usual = plan_run_times(plan.settings, 0, dt, behavior.period)
        steps = min(usual.held, usual.window)
        for seed in plan.seeds[:MEASURED_SEEDS]:
            times = RunTimes(count_walk_steps(task, seed), steps, 0, steps, usual.bin, dt)
            runs.append(HeldRunPlan(behavior.name, seed, times, start=task.start))
    return runs


def plan_task_episode(
    plan: EvaluationPlan, run: TaskRun, measured: Mapping[str, Sequence[PushMeasurement]]
) -> TaskEpisode | None:
    """Return what to run.

    Args:
        plan: The evaluation.
        run: The run.
        measured: What the measuring runs found, by behavior.

    Returns:
        The episode; None for a substitute whose size was not measured, because the robot fell before.
    """
    behavior = plan.loop.map.behaviors[run.behavior]
    task, dt = plan.loop.robot.find_task(behavior.task), plan.loop.robot.control_dt
    bin_steps = plan_run_times(plan.settings, run.seed, dt).bin
    times = RunTimes(count_walk_steps(task, run.seed), run.steps, 0, task.steps, bin_steps, dt)
    substitute = plan.draw_substitute(run.kind, run.behavior, run.draw, measured)
    if run.kind != "units" and substitute is None:
        return None
    held = HeldRunPlan(
        run.behavior if run.pressed else "",
        run.seed,
        times,
        find_condition(run.condition),
        substitute,
        plan.mean_observation_spread(measured),
        task.start,
    )
    return TaskEpisode(run, held)


def run_task_episode(built: ControlLoop, episode: TaskEpisode) -> TaskRunResult:
    """Run a behavior's task once through the control loop, as in a drive.

    Raises:
        MapError: The robot has no such task.
    """
    run, walk = episode.run, episode.plan.times.press
    behavior: Behavior = built.map.behaviors[run.behavior]
    task: Task = built.robot.find_task(behavior.task)
    with begin_held_run(built, episode.plan) as (loop, driven):
        before = loop.attributes
        records = list(driven)
    rows = np.array([before, *(record.attributes for record in records)])
    fell = records[-1].fell
    if len(rows) <= walk + 1:
        return TaskRunResult(TaskVerdict(False, 0.0, {}), fell)
    attributes = built.robot.attributes
    after = unwrap_angles(rows[walk + 1 :], attributes)
    at_once = after[: task.steps]
    fell_at_once = fell and len(after) <= task.steps
    verdict = task.judge(TaskRunTrace(attributes, rows[: walk + 1], at_once, fell_at_once))
    if run.steps == task.steps:
        return TaskRunResult(verdict, fell)
    whole = not fell and len(after) == run.steps
    still = task.judge(TaskRunTrace(attributes, rows[: walk + 1], after[-task.steps :], not whole))
    return TaskRunResult(verdict, fell, still)
