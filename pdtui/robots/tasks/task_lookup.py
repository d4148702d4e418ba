"""The tasks that pdtui knows."""

from __future__ import annotations

from pdtui.core.errors import MapError
from pdtui.robots.tasks import a1_tasks, bipedal_walker_tasks, walker_tasks
from pdtui.robots.tasks.task import Task

TASKS: tuple[Task, ...] = (*a1_tasks.TASKS, *walker_tasks.TASKS, *bipedal_walker_tasks.TASKS)


def tasks_of(robot: str) -> tuple[Task, ...]:
    """The tasks of a robot; most robots have none."""
    return tuple(task for task in TASKS if task.robot == robot)


def find_task(name: str, robot: str) -> Task:
    """The task of a robot by its name.

    Raises:
        MapError: the robot has none of that name.
    """
    mine = tasks_of(robot)
    for task in mine:
        if task.name == name:
            return task
    known = f"there are {', '.join(task.name for task in mine)}" if mine else "it has none"
    raise MapError(f"{robot}: no task '{name}'; {known}")
