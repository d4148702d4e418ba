"""A task of a robot: its start state, its duration, and the judge that tells whether it was done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, attribute_column
from pdtui.core.errors import MapError
from pdtui.core.outcome import Outcome, is_failure


@dataclass(frozen=True)
class TaskRunTrace:
    """The attributes during one run of a task.

    Attributes:
        attributes: The robot's attributes.
        walked: Their values at each control step before the behavior was latched, shape (W, J).
        values: Their values from then on, shape (T, J), angles unwrapped, up to the end of the episode.
        outcome: How the episode ended, or that it arrived; None if it went on to the end of the task.
    """

    attributes: Sequence[Attribute]
    walked: Floats
    values: Floats
    outcome: Outcome | None = None

    def before(self, name: str) -> Floats:
        """Return an attribute before the behavior, shape (W,)."""
        column: Floats = self.walked[:, attribute_column(name, self.attributes, "task")]
        return column

    def __getitem__(self, name: str) -> Floats:
        """Return an attribute from the behavior on, shape (T,)."""
        column: Floats = self.values[:, attribute_column(name, self.attributes, "task")]
        return column

    def __len__(self) -> int:
        return len(self.values)

    def mean_before(self, name: str, steps: int) -> float:
        """Return the mean of an attribute over the last steps before the behavior."""
        return float(self.before(name)[-steps:].mean())

    def mean(self, name: str, window: slice, missing: float = 0.0) -> float:
        """Return the mean of an attribute in a window of steps, or `missing` if the run ends before it."""
        values = self[name][window]
        return float(values.mean()) if len(values) else missing

    def stays_up(self, steps: int) -> bool:
        """Return whether the run has that many steps and did not fail."""
        return not is_failure(self.outcome) and len(self) >= steps


@dataclass(frozen=True)
class TaskVerdict:
    """The judgment of one run of a task.

    Attributes:
        success: Whether the task was done.
        score: How nearly it was done, for searches: 1 or more for a success.
        figures: Measured values by name with unit.
    """

    success: bool
    score: float
    figures: dict[str, float]


def average_figures(verdicts: Iterable[TaskVerdict]) -> dict[str, float]:
    """Return the mean of each figure over the verdicts that have it."""
    found: dict[str, list[float]] = {}
    for verdict in verdicts:
        for name, value in verdict.figures.items():
            found.setdefault(name, []).append(value)
    return {name: float(np.mean(values)) for name, values in found.items()}


@dataclass(frozen=True)
class Task:
    """Something for a robot to accomplish.

    Attributes:
        name: Name in maps.
        key: Key to which a map binds it.
        says: What one sees, in one sentence.
        wanted: What counts as done, for tables.
        walk: Fewest and most control steps before the behavior. Each seed draws its own number, so that the
            behavior meets different phases of the gait.
        steps: Control steps that are judged from the behavior on.
        judge: Gives the verdict on a run.
        start: State in which the robot starts; empty for the usual one.
        period: Longest duration of the behavior, in control steps; None for no limit.
        follows: Name of the task after which this one is needed; empty if it is done from a walk. An
            evaluation also judges it there, where the map has a behavior for that task.
    """

    name: str
    key: str
    says: str
    wanted: str
    walk: tuple[int, int]
    steps: int
    judge: Callable[[TaskRunTrace], TaskVerdict]
    start: str = ""
    period: int | None = None
    follows: str = ""


def find_longest_run(flags: NDArray[np.bool_]) -> int:
    """Return the length of the longest run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def find_task(name: str, tasks: Sequence[Task], owner: str) -> Task:
    """Return the task of a name.

    Raises:
        MapError: There is no such task; the message names `owner`.
    """
    for task in tasks:
        if task.name == name:
            return task
    known = f"available: {', '.join(task.name for task in tasks)}" if tasks else "it has none"
    raise MapError(f"{owner}: no task '{name}'; {known}")
