"""How much a search for a task does."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.search.evolutionary_search import EvolutionSettings


@dataclass(frozen=True, kw_only=True)
class TaskSearchSettings(EvolutionSettings):
    """How much a search for a task does.

    Attributes:
        values: outputs at which every unit is tried alone.
        strong_values: further outputs, where only some units are tried.
        screen_seeds: walks from which they are tried.
        screen_units: how many units are tried, each at the output that pushes a component of the action most;
            None tries all at all `values`.
        quick_seeds, full_seeds: walks of the quick score of a child, and of the full one.
        selection_seeds: walks of the final score.
        held_out_seeds: walks of the figures.
        unit_cost: score that each unit has to bring.
        onset: whether the search ends with one for the phase of the gait at which the behavior should begin.
        restarts: how often the search starts anew if it ends before its time, and the task is not yet done on
            every walk of the selection.
    """

    values: tuple[float, ...] = (-6.0, -2.0, 2.0, 6.0)
    strong_values: tuple[float, ...] = (-20.0, 20.0)
    screen_seeds: int = 1
    screen_units: int | None = None
    elite: int = 20
    children: int = 32
    quick_seeds: int = 2
    full_seeds: int = 8
    max_units: tuple[int, ...] = (3, 8, 24)
    generations: int = 16
    finalists: int = 8
    selection_seeds: int = 20
    held_out_seeds: int = 20
    unit_cost: float = 0.002
    onset: bool = False
    restarts: int = 100


QUICK_TASK_SEARCH = TaskSearchSettings(
    values=(-4.0, 4.0), screen_units=32, children=4, promoted=2, elite=4, quick_seeds=1, full_seeds=2,
    max_units=(3,), generations=1, finalists=2, selection_seeds=2, held_out_seeds=4, restarts=0,
)  # fmt: skip
