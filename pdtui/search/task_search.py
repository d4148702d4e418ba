"""Search for a stimulation, and its duration, that does a task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.unit_selection import select_outputs_by_action_change
from pdtui.robots.robot import Robot
from pdtui.robots.task import Task, TaskVerdict
from pdtui.search.evolutionary_search import Deadline, EvolutionarySearch, EvolutionProblem
from pdtui.search.onsets.onset_search import search_onset
from pdtui.search.stimulation_sampler import CROSSED, StimulationSampler
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations
from pdtui.search.task_search_settings import TaskSearchSettings
from pdtui.search.verdict_journal import PlanJudgingJob, VerdictJournal
from pdtui.stimulation.seed_ranges import JUDGING_SEEDS, require_search_seeds

_SEEDS_APART = 1000
"""Seeds from the first of one stage to the first of the next."""
_RETIMED = 0.4
"""Below this random number, and from `CROSSED` on, a child gets another period."""
_PERIOD_SPREAD = 0.3
"""Standard deviation of the logarithm of a factor on a period."""


@dataclass(frozen=True)
class TaskSearchResult:
    """The result of a search for a task.

    Attributes:
        task: the task.
        plan: the best stimulation and its duration.
        search_score: score on the walks that the search saw, which is partly luck.
        verdicts: verdicts with the stimulation on held-out walks.
        untouched: verdicts without it on the same walks.
        rollouts: number of roll-outs of the search.
        seeds: seeds on which something was chosen.
    """

    task: Task
    plan: StimulationWithDuration
    search_score: float
    verdicts: tuple[TaskVerdict, ...]
    untouched: tuple[TaskVerdict, ...]
    rollouts: int
    seeds: tuple[range, ...]

    @property
    def done(self) -> int:
        """On how many held-out walks the task was done."""
        return sum(verdict.success for verdict in self.verdicts)

    @property
    def done_without(self) -> int:
        """On how many of these walks it was done without the stimulation."""
        return sum(verdict.success for verdict in self.untouched)


class TaskSearch:
    """Search for a stimulation, and its duration, that does a task.

    The walks of the search have the seeds from ``seed`` on, those of the selection from ``seed + 1000`` on,
    and those on which an onset is compared with none from ``seed + 2000`` on.
    The figures are measured on the last of the seeds for judging, which nothing is chosen on.

    Args:
        pool: runs the roll-outs.
        task: the task.
        seed: first seed of the walks, and seed of every random choice.
        settings: how much to do.
        known: plans to begin with besides the best single units.
        units: flat indices of the units that are tried alone; None for those that the settings say.
        journal: keeps every verdict; what it holds is not run again. None for none.

    Raises:
        SeedError: a seed is reserved for judging.
    """

    def __init__(
        self,
        pool: RolloutPool,
        task: Task,
        seed: int,
        settings: TaskSearchSettings,
        known: Sequence[StimulationWithDuration] = (),
        units: Sequence[int] | None = None,
        journal: VerdictJournal | None = None,
    ) -> None:
        self._pool, self._task, self._seed, self._settings, self._known = pool, task, seed, settings, known
        self._units, self._journal = units, journal
        self._rng, self._rollouts = np.random.default_rng(seed), 0
        require_search_seeds([seed], f"the search for '{task.name}'")

    def run(self, deadline: Deadline, progress: StepProgress | None = None) -> TaskSearchResult:
        """Try every unit alone, search, select on other walks, and measure on held-out ones.

        Args:
            deadline: asked between generations.
            progress: called with (roll-outs done, roll-outs) while units are tried alone, then with
                (generations done, generations).
        """
        settings = self._settings
        singles, weights = self._screen(progress)
        problem = EvolutionProblem(
            first=lambda round_: [*self._known, *singles] if round_ == 0 else [],
            vary=partial(self._vary, StimulationSampler(weights, settings.bounds, self._rng)),
            quick=partial(self._score, seeds=settings.quick_seeds),
            full=partial(self._score, seeds=settings.full_seeds),
            final=self._count_successes,
        )
        search_score, best = self._search_again_and_again(problem, deadline, progress)
        if settings.onset:
            seeds, fresh = (self._seeds(stage, settings.selection_seeds) for stage in (1, 2))
            best = search_onset(self._pool, best, seeds, fresh, self._judge, start=self._task.start)
        plans, seeds = [best, StimulationWithDuration()], JUDGING_SEEDS[-settings.held_out_seeds :]
        verdicts, untouched = map(tuple, self._judge(plans, seeds, one_by_one=True))
        return TaskSearchResult(
            self._task, best, search_score, verdicts, untouched, self._rollouts, self.seeds
        )

    def _search_again_and_again(
        self,
        problem: EvolutionProblem[StimulationWithDuration],
        deadline: Deadline,
        progress: StepProgress | None,
    ) -> tuple[float, StimulationWithDuration]:
        """Return the best plan of one search after the other, with its score on the walks of its search."""
        settings = self._settings
        found = []
        for _ in range(1 + settings.restarts):
            score, plan = EvolutionarySearch(problem, settings).run(deadline, progress)
            (done,) = self._count_successes([plan])
            found.append((done, score, plan))
            if deadline() or done[0] == settings.selection_seeds:
                break
        _, score, plan = max(found, key=lambda one: one[0])
        return score, plan

    def _vary(
        self, sampler: StimulationSampler, elite: Sequence[StimulationWithDuration], max_units: int
    ) -> StimulationWithDuration:
        """Cross two of the elite, or change the period or the stimulation of one."""
        rng = self._rng
        parent, other = sampler.choose_parent(elite), sampler.choose_parent(elite)
        kind = rng.random()
        if kind < CROSSED:
            crossed = sampler.cross_over(parent.stimulation, other.stimulation, max_units)
            return replace(parent, stimulation=crossed)
        if kind < _RETIMED and parent.steps is not None and self._task.period is not None:
            steps = round(parent.steps * float(np.exp(rng.normal(0.0, _PERIOD_SPREAD))))
            return replace(parent, steps=int(np.clip(steps, 2, self._task.period)))
        return replace(parent, stimulation=sampler.mutate(parent.stimulation, max_units))

    def _count_successes(self, plans: Sequence[StimulationWithDuration]) -> list[tuple[int, float]]:
        """Return on how many walks of the selection the task was done; scores decide between equals."""
        rows = self._judge(plans, self._seeds(1, self._settings.selection_seeds))
        return [(sum(v.success for v in row), sum(v.score for v in row)) for row in rows]

    def _screen(self, progress: StepProgress | None) -> tuple[list[StimulationWithDuration], Floats]:
        """Return the best single units, and weights by which to draw units."""
        settings, units = self._settings, self._pool.policy.units
        longest, pairs = self._task.period, self._pairs_to_screen()
        periods = [None if longest is None else longest // 2]
        if longest is not None and len(pairs) < units:  # few enough to try each for all of the time, too
            periods.append(longest)
        plans = [
            StimulationWithDuration(Stimulation.of({unit: value}), period)
            for unit, value in pairs
            for period in periods
        ]
        scores = self._score(plans, settings.screen_seeds, progress)
        weights = np.zeros(units)
        for (unit, _), best in zip(pairs, scores.reshape(len(pairs), -1).max(axis=1), strict=True):
            weights[unit] = max(weights[unit], best - np.median(scores))
        order = np.argsort(-scores, kind="stable")[: settings.children]
        return [plans[index] for index in order], weights + (weights.mean() or 1.0)

    def _pairs_to_screen(self) -> list[tuple[int, float]]:
        """Return the units to try alone, with their outputs v: all, or those that push the action most."""
        settings, units = self._settings, self._pool.policy.units
        tried = range(units) if self._units is None else self._units
        limit = settings.screen_units
        if self._units is None and limit is not None and limit < units:
            options = {"start": self._task.start} if self._task.start else None
            values = sorted({*settings.values, *settings.strong_values})
            chosen = select_outputs_by_action_change(
                self._pool.robot, self._pool.policy, values, limit, seed=self._seed, options=options
            )
            return list(chosen)
        return [(unit, value) for unit in tried for value in settings.values]

    @property
    def seeds(self) -> tuple[range, ...]:
        """The seeds on which something is chosen."""
        settings = self._settings
        searched = max(settings.screen_seeds, settings.quick_seeds, settings.full_seeds)
        stages = (1, 2) if settings.onset else (1,)
        chosen = (self._seeds(stage, settings.selection_seeds) for stage in stages)
        return self._seeds(0, searched), *chosen

    def _seeds(self, stage: int, count: int) -> range:
        first = self._seed + stage * _SEEDS_APART
        return range(first, first + count)

    def _score(
        self, plans: Sequence[StimulationWithDuration], seeds: int, progress: StepProgress | None = None
    ) -> Floats:
        table = self._judge(plans, self._seeds(0, seeds), progress)
        means = np.array([np.mean([verdict.score for verdict in row]) for row in table])
        units = np.array([len(plan.stimulation.units) for plan in plans])
        scores: Floats = means - self._settings.unit_cost * units
        return scores

    def _judge(
        self,
        plans: Sequence[StimulationWithDuration],
        seeds: Sequence[int],
        progress: StepProgress | None = None,
        one_by_one: bool = False,
    ) -> list[list[TaskVerdict]]:
        """Return the verdicts of each plan on each seed."""
        self._rollouts += len(plans) * len(seeds)
        size = max(1, min(32, len(plans) // 2 + 1))
        parts = [tuple(plans[low : low + size]) for low in range(0, len(plans), size)]
        jobs = [(self._task.name, part, seed, one_by_one) for part in parts for seed in seeds]
        results = iter(self._pool.map(judge_task_plans, jobs, progress, self._journal))
        rows: list[list[TaskVerdict]] = []
        for part in parts:
            columns = [next(results) for _ in seeds]
            rows += [[column[index] for column in columns] for index in range(len(part))]
        return rows


def judge_task_plans(robot: Robot, policy: Policy, job: PlanJudgingJob) -> list[TaskVerdict]:
    """Judge plans in a worker process; tasks hold functions, so they travel by name."""
    name, plans, seed, one_by_one = job
    return judge_stimulations(robot, policy, robot.find_task(name), plans, seed, one_by_one)
