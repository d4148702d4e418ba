"""The success of behaviors in their tasks: each seed is driven with the behavior and without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import unwrap_angles
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import run_episode
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict, average_figures
from pdtui.search.task_rollout import count_walk_steps
from pdtui.stimulation.stimulation_map import Behavior


@dataclass(frozen=True)
class TaskEvaluation:
    """The success of one behavior over all seeds.

    Attributes:
        wanted: what counts as success.
        done: number of seeds with success with the behavior.
        by_itself: number of seeds with success without it.
        falls: number of seeds on which the robot fell with the behavior.
        figures: the task's measures with the behavior, means over seeds.
        figures_by_itself: the same without it.
    """

    behavior: str
    task: str
    wanted: str
    done: int
    by_itself: int
    falls: int
    figures: dict[str, float]
    figures_by_itself: dict[str, float]


@dataclass(frozen=True)
class TaskRunResult:
    """The verdict on one run, and whether the robot fell."""

    verdict: TaskVerdict
    fell: bool


def run_task_episode(built: ControlLoop, behavior: Behavior, seed: int, *, untouched: bool) -> TaskRunResult:
    """Run a behavior's task once through the control loop, as in a drive.

    Raises:
        MapError: the robot has no such task.
    """
    task = built.robot.find_task(behavior.task)
    loop = ControlLoop(built.robot, built.policy, built.map, seed, start=task.start)
    walk = count_walk_steps(task, seed)

    def press(step: int) -> list[DriveEvent]:
        return [DriveEvent(step, "behavior", behavior.name)] if step == walk and not untouched else []

    before = loop.attributes
    records = list(run_episode(loop, walk + task.steps, press))
    rows = [before, *(record.attributes for record in records)]
    fell = records[-1].fell
    if len(rows) <= walk + 1:
        return TaskRunResult(TaskVerdict(False, 0.0, {}), fell)
    attributes, values = loop.robot.attributes, np.array(rows)
    trace = TaskRunTrace(attributes, values[: walk + 1], unwrap_angles(values[walk + 1 :], attributes), fell)
    return TaskRunResult(task.judge(trace), fell)


def summarise_task(
    behavior: Behavior, task: Task, runs: Sequence[TaskRunResult], untouched: Sequence[TaskRunResult]
) -> TaskEvaluation:
    """Summarise the runs of one behavior."""
    return TaskEvaluation(
        behavior.name,
        task.name,
        task.wanted,
        sum(run.verdict.success for run in runs),
        sum(run.verdict.success for run in untouched),
        sum(run.fell for run in runs),
        average_figures(run.verdict for run in runs),
        average_figures(run.verdict for run in untouched),
    )
