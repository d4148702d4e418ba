"""The search engine: successive halving of candidate plans, and evolution of those that survive it.

What a plan is, how it is scored and how it is varied is for the user of the engine to say: a behavior search
and a task search vary sets of units with `EvolutionarySearch`, a controller search and gain tuning choose
between controllers with `select_plans`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any, Generic, NamedTuple, TypeVar

from pdtui.core.processes.worker_pool import StepProgress
from pdtui.search.stimulation_sampler import UnitOutputBounds

Plan = TypeVar("Plan")
PlanScoring = Callable[[Sequence[Plan]], Iterable[Any]]
"""Returns scores of plans, in their order: numbers or tuples of numbers, larger is better."""
Deadline = Callable[[], bool]
"""Whether the time of a search is over."""

_PROGRESS = 0.01
"""Rise of the best score that counts as progress of a generation."""
_ATTEMPTS = 20
"""Attempts to vary the elite into a plan that was not tried before."""


class PlanScoringStage(NamedTuple, Generic[Plan]):
    """One stage of a selection: how it scores plans, and how many of the best it keeps."""

    score: PlanScoring[Plan]
    keep: int


def select_plans(plans: Sequence[Plan], stages: Iterable[PlanScoringStage[Plan]]) -> list[tuple[Any, Plan]]:
    """Return the plans that survive all stages with their scores at the last one, the best first.

    Each stage scores what the one before it kept, usually more thoroughly: successive halving (Jamieson and
    Talwalkar, 2016). Of equal plans the earlier ones are kept.
    """
    ranked: list[tuple[Any, Plan]] = [(None, plan) for plan in plans]
    for stage in stages:
        left = [plan for _, plan in ranked]
        ranked = sorted(zip(stage.score(left), left, strict=True), key=lambda pair: pair[0], reverse=True)
        del ranked[stage.keep :]
    return ranked


class SharedTimeBudget:
    """Shares what is left of a time budget equally among the searches that are still to run.

    Args:
        minutes: the budget; None for no limit.
        began: when it began, in seconds of `time.monotonic`; None for now.
    """

    def __init__(self, minutes: float | None, began: float | None = None) -> None:
        self._end = inf if minutes is None else (time.monotonic() if began is None else began) + 60 * minutes

    def share(self, searches: int = 1) -> Deadline:
        """Return the deadline of the next search when `searches` are still to run."""
        now = time.monotonic()
        until = now + max(0.0, self._end - now) / max(1, searches)
        return lambda: time.monotonic() >= until


@dataclass(frozen=True, kw_only=True)
class EvolutionSettings:
    """How much an evolutionary search does.

    Attributes:
        elite: plans kept from one generation to the next.
        children: plans of one generation.
        promoted: plans of a generation that get the full score.
        max_units: largest number of units of a plan, for each round; rounds follow as long as no score is
            safe.
        generations: largest number of generations of a round.
        patience: generations without progress after which a round ends.
        finalists: plans of the elite that the final score decides between.
        bounds: limits of the outputs v.
    """

    elite: int = 16
    children: int = 28
    promoted: int = 8
    max_units: tuple[int, ...] = (3, 8, 24, 64)
    generations: int = 24
    patience: int = 6
    finalists: int = 6
    bounds: UnitOutputBounds = field(default_factory=UnitOutputBounds)


@dataclass(frozen=True)
class EvolutionProblem(Generic[Plan]):
    """What an evolutionary search is for.

    Attributes:
        first: returns the plans that a round begins with, given its number.
        vary: returns a new plan, given the elite from the best on and the largest number of units.
        quick: scores all plans of a generation.
        full: scores the most promising of them.
        final: scores the finalists, on episodes that the search has not seen.
        satisfied: full score at which a round ends early.
        safe: full score from which no round with more units follows.
    """

    first: Callable[[int], Sequence[Plan]]
    vary: Callable[[Sequence[Plan], int], Plan]
    quick: PlanScoring[Plan]
    full: PlanScoring[Plan]
    final: PlanScoring[Plan]
    satisfied: float = inf
    safe: float = inf


class EvolutionarySearch(Generic[Plan]):
    """Evolution of hashable plans.

    The best children of a generation join the elite that the next one is varied from. A round that ends
    without a safe score is followed by one that may use more units.

    Args:
        problem: proposes, varies and scores plans.
        settings: how much to do.
    """

    def __init__(self, problem: EvolutionProblem[Plan], settings: EvolutionSettings) -> None:
        self._problem, self._settings = problem, settings
        self._elite: list[tuple[float, Plan]] = []
        self._seen: set[Plan] = set()

    @property
    def tried(self) -> int:
        """Number of plans that were scored."""
        return len(self._seen)

    def run(self, deadline: Deadline, progress: StepProgress | None = None) -> tuple[float, Plan]:
        """Return the best plan with its full score, which flatters it a little.

        Args:
            deadline: asked between generations.
            progress: called with (generations done, generations).
        """
        problem, settings = self._problem, self._settings
        total = settings.generations * len(settings.max_units)
        for round_, max_units in enumerate(settings.max_units):
            self._add_generation(problem.first(round_))
            idle = 0
            for number in range(settings.generations):
                if progress is not None:
                    progress(round_ * settings.generations + number, total)
                best = self._elite[0][0]
                if best >= problem.satisfied or idle >= settings.patience or deadline():
                    break
                self._add_generation([self._child(max_units) for _ in range(settings.children)])
                idle = 0 if self._elite[0][0] > best + _PROGRESS else idle + 1
            if self._elite[0][0] >= problem.safe:
                break
        if progress is not None:
            progress(total, total)
        scores = {plan: score for score, plan in self._elite[: settings.finalists]}
        ((_, winner),) = select_plans(list(scores), [PlanScoringStage(problem.final, 1)])
        return scores[winner], winner

    def choose_among(self, plans: Sequence[Plan]) -> Plan:
        """Return the best of some plans, chosen with as many scores per plan as those of the search."""
        problem, settings = self._problem, self._settings
        promoted = max(settings.finalists, len(plans) * settings.promoted // settings.children)
        stages = (
            PlanScoringStage(problem.quick, promoted),
            PlanScoringStage(problem.full, settings.finalists),
            PlanScoringStage(problem.final, 1),
        )
        ((_, winner),) = select_plans(plans, stages)
        return winner

    def _child(self, max_units: int) -> Plan:
        elite = [plan for _, plan in self._elite]
        for _ in range(_ATTEMPTS):
            child = self._problem.vary(elite, max_units)
            if child not in self._seen:
                break
        return child

    def _add_generation(self, plans: Sequence[Plan]) -> None:
        fresh = list(dict.fromkeys(plan for plan in plans if plan not in self._seen))
        if not fresh:
            return
        self._seen.update(fresh)
        promoted = self._settings.promoted
        stages = (
            PlanScoringStage(self._problem.quick, promoted),
            PlanScoringStage(self._problem.full, promoted),
        )
        self._elite += [(float(score), plan) for score, plan in select_plans(fresh, stages)]
        self._elite.sort(key=lambda pair: -pair[0])
        del self._elite[self._settings.elite :]
