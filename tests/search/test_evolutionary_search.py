"""The engine, on plans whose scores are known: it selects, varies, stops and keeps to its budget."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from pdtui.search.evolutionary_search import (
    EvolutionarySearch,
    EvolutionProblem,
    EvolutionSettings,
    PlanScoringStage,
    SharedTimeBudget,
    select_plans,
)

SETTINGS = EvolutionSettings(
    elite=4, children=8, promoted=3, max_units=(2, 4), generations=20, patience=20, finalists=2
)


def _never() -> bool:
    return False


class _Target:
    """Integers are plans; the nearer to 100, the better. Counts what is scored."""

    def __init__(self, **limits: float) -> None:
        self.rng = np.random.default_rng(7)
        self.quick: list[int] = []
        self.full: list[int] = []
        self.problem = EvolutionProblem(
            self._first, self._vary, self._quick, self._full, self._final, **limits
        )

    def _first(self, round_: int) -> list[int]:
        return [0, 1] if round_ == 0 else []

    def _vary(self, elite: Sequence[int], max_units: int) -> int:
        assert elite == sorted(elite, key=lambda plan: abs(plan - 100))
        return int(elite[0] + self.rng.integers(-max_units, 5 * max_units))

    def _quick(self, plans: Sequence[int]) -> list[float]:
        self.quick += plans
        return [-abs(plan - 100) for plan in plans]

    def _full(self, plans: Sequence[int]) -> list[float]:
        self.full += plans
        return [-float(abs(plan - 100)) for plan in plans]

    def _final(self, plans: Sequence[int]) -> list[tuple[int, int]]:
        return [(0, plan) for plan in plans]


def test_stages_pass_on_the_best_and_of_equals_the_first() -> None:
    seen: list[list[int]] = []

    def score(plans: Sequence[int]) -> list[int]:
        seen.append(list(plans))
        return [plan % 10 for plan in plans]

    ranked = select_plans([11, 23, 42, 33, 1], [PlanScoringStage(score, 3), PlanScoringStage(score, 2)])
    assert ranked == [(3, 23), (3, 33)]
    assert seen == [[11, 23, 42, 33, 1], [23, 33, 42]]
    assert select_plans([5, 6], []) == [(None, 5), (None, 6)]


def test_the_search_climbs_and_never_scores_a_plan_twice() -> None:
    target = _Target()
    score, plan = EvolutionarySearch(target.problem, SETTINGS).run(_never)
    # The final score prefers the larger of the two best, whose full scores are 0 and −1.
    assert (score, plan) in {(0.0, 100), (-1.0, 101)}
    assert len(target.quick) == len(set(target.quick))
    assert set(target.full) < set(target.quick)


def test_a_safe_score_keeps_a_round_with_more_units_from_following() -> None:
    steps: list[tuple[int, int]] = []
    target = _Target(satisfied=-90.0, safe=-95.0)
    score, _ = EvolutionarySearch(target.problem, SETTINGS).run(_never, lambda *done: steps.append(done))
    assert score >= -95.0
    assert steps[-1] == (40, 40)
    assert all(done < 20 for done, _ in steps[:-1])


def test_a_search_out_of_time_returns_the_best_of_its_first_plans() -> None:
    target = _Target()
    score, plan = EvolutionarySearch(target.problem, SETTINGS).run(lambda: True)
    assert (score, plan) == (-99.0, 1)
    assert target.quick == [0, 1]


def test_a_time_budget_is_shared_by_the_searches_to_come(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr("pdtui.search.evolutionary_search.time.monotonic", lambda: now)
    budget = SharedTimeBudget(1.0)
    first = budget.share(3)
    assert not first()
    now = 1020.0
    assert first()
    now = 1010.0
    last = budget.share(1)
    now = 1059.0
    assert not last()
    now = 1060.0
    assert last()
    assert not SharedTimeBudget(None).share()()
