"""The runs of tasks in an evaluation: through the control loop, as in a drive, and judged.

Each seed is driven with the behavior and without it. What is needed after another task, such as standing up
after a flip, is also driven there, on the seeds on which the behavior for that task succeeds. A behavior that
lasts until it is released is also held for as long as one with an aim, and the task's judge sees the last
part of that hold, too. A behavior with an onset is judged from the control step in which it begins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import unwrap_angles
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.evaluation.disturbance_conditions import UNDISTURBED, find_condition
from pdtui.evaluation.evaluation_plan import MEASURED_SEEDS, EvaluationPlan, SubstituteKind
from pdtui.evaluation.held_run import HeldRunPlan, InterventionMeasurement, begin_held_run
from pdtui.evaluation.protocol_settings import RunTimes, plan_run_times
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict
from pdtui.search.task_rollout import LONGEST_WAIT, count_walk_steps


class TaskRunKey(NamedTuple):
    """One run of a task.

    Attributes:
        behavior: Name of the behavior.
        seed: Seed of the run.
        pressed: Whether the behavior is pressed.
        steps: Control steps from the press on.
        condition: Name of the condition.
        kind: What is pushed.
        draw: Number of the draw of a random kind.
        after: Name of the behavior that is done before; empty for a run from the task's own start.
    """

    behavior: str
    seed: int
    pressed: bool
    steps: int
    condition: str = UNDISTURBED.name
    kind: SubstituteKind = "units"
    draw: int = 0
    after: str = ""


@dataclass(frozen=True)
class TaskEpisode:
    """A run of a task with everything that it takes to run it."""

    run: TaskRunKey
    plan: HeldRunPlan


@dataclass(frozen=True)
class TaskRunResult:
    """The judgment of one run.

    Attributes:
        verdict: The verdict on the task.
        outcome: How the episode ended, or that it arrived; None if it lasted as long as planned.
        still: The verdict on the end of a long hold; None for a run without.
        reached_press: Whether the run came as far as the press, with what is done before done.
    """

    verdict: TaskVerdict
    outcome: Outcome | None
    still: TaskVerdict | None = None
    reached_press: bool = True


def list_task_runs(plan: EvaluationPlan) -> list[TaskRunKey]:
    """Return the runs of all tasks; only those in the robot's own world include a long hold."""
    runs = []
    for behavior in plan.tasked:
        name, task = behavior.name, plan.loop.robot.find_task(behavior.task)
        held = max(task.steps, plan_run_times(plan.settings, 0, plan.loop.robot.control_dt).held)
        for condition in plan.conditions:
            long = condition == UNDISTURBED.name and behavior.period is None
            seeds = plan.seeds_of(condition)
            runs += [TaskRunKey(name, seed, True, held if long else task.steps, condition) for seed in seeds]
            runs += [TaskRunKey(name, seed, False, task.steps, condition) for seed in seeds]
        runs += [
            TaskRunKey(name, seed, True, task.steps, UNDISTURBED.name, kind, draw)
            for kind, draws in plan.substitutes_of(behavior)
            for draw in range(draws)
            for seed in plan.seeds[: plan.settings.draw_seeds]
        ]
        runs += [
            TaskRunKey(name, seed, pressed, task.steps, after=earlier.name)
            for earlier in plan.tasked
            if earlier.task == task.follows
            for pressed in (True, False)
            for seed in plan.seeds
        ]
    return runs


def count_task_steps(plan: EvaluationPlan, run: TaskRunKey) -> int:
    """Return how many control steps a run of a task has; an episode that ends early makes it fewer."""
    return _press_step(plan.loop, run) + run.steps + _most_waiting_steps(plan.loop, run)


def _press_step(loop: ControlLoop, run: TaskRunKey) -> int:
    """Return the control step before which the behavior is pressed."""
    first = _task_of(loop, run.after or run.behavior)
    return count_walk_steps(first, run.seed) + (first.steps if run.after else 0)


def _most_waiting_steps(loop: ControlLoop, run: TaskRunKey) -> int:
    """Return for how many control steps a pressed behavior may wait for its onset."""
    waits = run.pressed and loop.map.behaviors[run.behavior].onset is not None
    return round(LONGEST_WAIT / loop.robot.control_dt) if waits else 0


def _task_of(loop: ControlLoop, behavior: str) -> Task:
    return loop.robot.find_task(loop.map.behaviors[behavior].task)


def task_measuring_runs(plan: EvaluationPlan) -> list[HeldRunPlan]:
    """Return the runs that measure how far behaviors with a task move units and actions.

    They begin as the task does, and end after the period or, if it is shorter, the first window.
    """
    runs = []
    for behavior in plan.tasked:
        if not plan.changes_units(behavior):
            continue
        task, dt = plan.loop.robot.find_task(behavior.task), plan.loop.robot.control_dt
        usual = plan_run_times(plan.settings, 0, dt, behavior.period)
        steps = min(usual.held, usual.window)
        for seed in plan.seeds[:MEASURED_SEEDS]:
            times = RunTimes(count_walk_steps(task, seed), steps, 0, steps, usual.bin, dt)
            runs.append(HeldRunPlan(behavior.name, seed, times, start=task.start))
    return runs


def plan_task_episode(
    plan: EvaluationPlan, run: TaskRunKey, measured: Mapping[str, Sequence[InterventionMeasurement]]
) -> TaskEpisode | None:
    """Return what to run.

    Args:
        plan: The evaluation.
        run: The run.
        measured: What the measuring runs found, by behavior.

    Returns:
        The episode; None for a substitute whose size was not measured, because the robot fell before.
    """
    loop, dt = plan.loop, plan.loop.robot.control_dt
    task, first = _task_of(loop, run.behavior), _task_of(loop, run.after or run.behavior)
    bin_steps = plan_run_times(plan.settings, run.seed, dt).bin
    steps = run.steps + _most_waiting_steps(loop, run)
    times = RunTimes(_press_step(loop, run), steps, 0, task.steps, bin_steps, dt)
    earlier = ((count_walk_steps(first, run.seed), run.after),) if run.after else ()
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
        first.start,
        earlier,
    )
    return TaskEpisode(run, held)


def run_task_episode(built: ControlLoop, episode: TaskEpisode) -> TaskRunResult:
    """Run a behavior's task once through the control loop, as in a drive.

    Raises:
        MapError: The robot has no such task.
    """
    run, press = episode.run, episode.plan.times.press
    task, attributes = _task_of(built, run.behavior), built.robot.attributes
    with begin_held_run(built, episode.plan) as (loop, driven):
        before = loop.attributes
        records = list(driven)
    rows = np.array([before, *(record.attributes for record in records)])
    outcome = next((record.outcome for record in reversed(records) if record.outcome), None)
    waited = _count_waiting_steps(records[press:], run.behavior)
    press += waited
    if len(rows) <= press + 1 or waited > _most_waiting_steps(built, run):
        return TaskRunResult(TaskVerdict(False, 0.0, {}), outcome, reached_press=not run.after)
    if run.after:
        walk = episode.plan.earlier[0][0]
        done = unwrap_angles(rows[walk + 1 : press + 1], attributes)
        first = _task_of(built, run.after).judge(TaskRunTrace(attributes, rows[: walk + 1], done))
        if not first.success:
            return TaskRunResult(TaskVerdict(False, 0.0, {}), outcome, reached_press=False)
    after = unwrap_angles(rows[press + 1 : press + 1 + run.steps], attributes)
    outcome = outcome if len(rows) <= press + 1 + run.steps else None
    at_once = after[: task.steps]
    outcome_at_once = outcome if len(after) <= task.steps else None
    verdict = task.judge(TaskRunTrace(attributes, rows[: press + 1], at_once, outcome_at_once))
    if run.steps == task.steps:
        return TaskRunResult(verdict, outcome)
    # An episode that ended early without failing is judged by its last part.
    still = task.judge(TaskRunTrace(attributes, rows[: press + 1], after[-task.steps :], outcome))
    return TaskRunResult(verdict, outcome, still)


def _count_waiting_steps(records: Sequence[StepRecord], behavior: str) -> int:
    """Return in how many control steps from the press on a behavior was armed before it began."""
    armed = [any(one.name == behavior and one.waiting is not None for one in r.behaviors) for r in records]
    return armed.index(False) if False in armed else len(armed)
