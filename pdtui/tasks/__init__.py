"""What behaviors of a robot are to accomplish, where a mean of one attribute does not say it."""

from pdtui.tasks.base import Task, Trace, Verdict, mean_figures
from pdtui.tasks.known import find_task, tasks_of
from pdtui.tasks.run import Burst, judge_seed

__all__ = ["Burst", "Task", "Trace", "Verdict", "find_task", "judge_seed", "mean_figures", "tasks_of"]
