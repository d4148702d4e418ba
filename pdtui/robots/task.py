"""A task: from which state, for how long, and how to tell whether it was done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Attribute, Floats, column_of
from pdtui.core.errors import MapError


@dataclass(frozen=True)
class RunTrace:
    """What one run showed.

    Attributes:
        attributes: of the robot.
        walked: their values at each control step before the behavior was latched, shape (W, J).
        values: from then on, shape (T, J), angles unwrapped; it ends where the episode did.
        fell: whether it fell.
    """

    attributes: Sequence[Attribute]
    walked: Floats
    values: Floats
    fell: bool

    def before(self, name: str) -> Floats:
        """An attribute before the behavior, shape (W,)."""
        column: Floats = self.walked[:, column_of(name, self.attributes, "task")]
        return column

    def __getitem__(self, name: str) -> Floats:
        """An attribute from the behavior on, shape (T,)."""
        column: Floats = self.values[:, column_of(name, self.attributes, "task")]
        return column

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True)
class TaskVerdict:
    """How a run went.

    Attributes:
        success: whether the task was done.
        score: how nearly, for searches: 1 and more where it was done.
        figures: what was measured, by name with its unit.
    """

    success: bool
    score: float
    figures: dict[str, float]


def mean_figures(verdicts: Iterable[TaskVerdict]) -> dict[str, float]:
    """Mean of each figure over the verdicts that have it."""
    found: dict[str, list[float]] = {}
    for verdict in verdicts:
        for name, value in verdict.figures.items():
            found.setdefault(name, []).append(value)
    return {name: float(np.mean(values)) for name, values in found.items()}


@dataclass(frozen=True)
class Task:
    """Something to accomplish.

    Attributes:
        name: as maps name it.
        key: that a map binds it to.
        says: one sentence on what one sees.
        wanted: what counts as done, for tables.
        walk: fewest and most control steps before the behavior; each seed draws its own number, so that the
            behavior meets other phases of the gait.
        steps: control steps that are watched from the behavior on.
        judge: the verdict on a run.
        start: state in which the robot starts, empty for the usual one.
        period: longest time that the behavior may last, in control steps; None where it goes on.
    """

    name: str
    key: str
    says: str
    wanted: str
    walk: tuple[int, int]
    steps: int
    judge: Callable[[RunTrace], TaskVerdict]
    start: str = ""
    period: int | None = None


def find_task(name: str, tasks: Sequence[Task], owner: str) -> Task:
    """Return the task of a name; `owner` is named where there is none.

    Raises:
        MapError: there is no such task.
    """
    for task in tasks:
        if task.name == name:
            return task
    known = f"there are {', '.join(task.name for task in tasks)}" if tasks else "it has none"
    raise MapError(f"{owner}: no task '{name}'; {known}")
