"""Search for the stimulation, and how long it lasts, that does a task."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots.robot import Robot
from pdtui.robots.task import Task, TaskVerdict
from pdtui.search.stimulation_sampler import OutputBounds, StimulationSampler
from pdtui.search.task_rollout import TimedStimulation, judge_stimulations
from pdtui.spectra.monitor import StepProgress

_SEEDS_APART = 1000
_TRIES = 20


@dataclass(frozen=True)
class TaskSearchSettings:
    """How much a pursuit does.

    Attributes:
        values: outputs at which every unit is tried alone.
        screen_seeds: from so many walks.
        screen_units: how many units, drawn at random; None tries all.
        elite, children, promoted: kept between generations, made in one, and looked at again.
        quick_seeds, full_seeds: walks of the first look at a child, and of the second.
        max_units: units at most, in the first round and in those that follow.
        generations, patience: of one round at most, and without progress before it ends.
        finalists, selection_seeds: elite that other walks decide between.
        held_out_seeds: walks of the figures.
        owed: score that each unit has to bring.
        bounds: of the outputs v.
    """

    values: tuple[float, ...] = (-6.0, -2.0, 2.0, 6.0)
    screen_seeds: int = 1
    screen_units: int | None = None
    elite: int = 20
    children: int = 32
    promoted: int = 8
    quick_seeds: int = 2
    full_seeds: int = 8
    max_units: tuple[int, ...] = (3, 8, 24)
    generations: int = 16
    patience: int = 6
    finalists: int = 8
    selection_seeds: int = 20
    held_out_seeds: int = 20
    owed: float = 0.002
    bounds: OutputBounds = field(default_factory=OutputBounds)


QUICK_TASK_SEARCH = TaskSearchSettings(
    values=(-4.0, 4.0), screen_units=32, children=4, promoted=2, elite=4, quick_seeds=1, full_seeds=2,
    max_units=(3,), generations=1, finalists=2, selection_seeds=2, held_out_seeds=4,
)  # fmt: skip


@dataclass(frozen=True)
class TaskSearchResult:
    """What a pursuit found.

    Attributes:
        task: what it was for.
        plan: the stimulation and how long it lasts.
        search_score: on the walks that the search saw; higher by what it owes to luck.
        verdicts: with it, on held-out walks.
        untouched: without it, on the same walks.
        rollouts: roll-outs that it took.
    """

    task: Task
    plan: TimedStimulation
    search_score: float
    verdicts: tuple[TaskVerdict, ...]
    untouched: tuple[TaskVerdict, ...]
    rollouts: int


class TaskSearch:
    """Seeded evolutionary search, from single units to the set that does a task.

    Walks of the stages have different seeds: ``seed`` on for the search, 1000 and 2000 further on for the
    selection and the figures.

    Args:
        pool: runs the roll-outs.
        task: what to do.
        seed: of the walks and of every random choice.
        settings: how much to do.
    """

    def __init__(self, pool: RolloutPool, task: Task, seed: int, settings: TaskSearchSettings) -> None:
        self._pool, self._task, self._seed, self._settings = pool, task, seed, settings
        self._rng = np.random.default_rng(seed)
        self._seen: set[TimedStimulation] = set()
        self._elite: list[tuple[float, TimedStimulation]] = []
        self._rollouts = 0

    def run(
        self,
        begin: Sequence[TimedStimulation],
        deadline: Callable[[], bool],
        progress: StepProgress | None = None,
    ) -> TaskSearchResult:
        """Screen, search, select on other walks, and measure on held-out ones.

        Args:
            begin: where else to begin.
            deadline: says when time is up.
            progress: called with (generations done, generations).
        """
        settings = self._settings
        atoms, source = self._screen(progress)
        total = settings.generations * len(settings.max_units)
        for round_, most in enumerate(settings.max_units):
            if round_ == 0:
                self._generation([*begin, *atoms])
            idle = 0
            for number in range(settings.generations):
                if progress is not None:
                    progress(round_ * settings.generations + number, total)
                if idle >= settings.patience or deadline():
                    break
                best = self._elite[0][0]
                self._generation([self._child(source, most) for _ in range(settings.children)])
                idle = 0 if self._elite[0][0] > best + 0.01 else idle + 1
            if deadline():
                break
        if progress is not None:
            progress(total, total)
        return self._finish()

    def _screen(self, progress: StepProgress | None) -> tuple[list[TimedStimulation], StimulationSampler]:
        """Units alone; the best of them, and a source that draws good ones more often."""
        settings, units = self._settings, self._pool.policy.units
        periods: list[int | None] = [None]
        if self._task.period is not None:
            periods = [self._task.period // 2]
        tried = np.arange(units)
        if settings.screen_units is not None and settings.screen_units < units:
            tried = np.sort(self._rng.choice(units, settings.screen_units, replace=False))
        plans = [
            TimedStimulation(Stimulation.of({unit: value}), period)
            for unit in tried.tolist()
            for value in settings.values
            for period in periods
        ]
        scores = self._score(plans, settings.screen_seeds, progress)
        weights = np.zeros(units)
        best = scores.reshape(len(tried), -1).max(axis=1)
        weights[tried] = np.maximum(best - np.median(scores), 0.0)
        weights += weights.mean() or 1.0
        order = np.argsort(-scores, kind="stable")
        return [plans[index] for index in order[: settings.children]], StimulationSampler(
            weights, settings.bounds, self._rng
        )

    def _child(self, source: StimulationSampler, most: int) -> TimedStimulation:
        elite = [plan for _, plan in self._elite]
        most = min(most, self._pool.policy.units)
        child = elite[0]
        for _ in range(_TRIES):
            first, second = (elite[int(self._rng.random() ** 2 * len(elite))] for _ in range(2))
            kind = self._rng.random()
            if kind < 0.25:
                child = TimedStimulation(
                    source.cross_over(first.stimulation, second.stimulation, most), first.steps
                )
            elif kind < 0.4 and first.steps is not None:
                child = TimedStimulation(first.stimulation, self._period(first.steps))
            else:
                child = TimedStimulation(source.mutate(first.stimulation, most), first.steps)
            if child not in self._seen:
                break
        return child

    def _period(self, steps: int) -> int:
        assert self._task.period is not None
        changed = round(steps * float(np.exp(self._rng.normal(0.0, 0.3))))
        return int(np.clip(changed, 2, self._task.period))

    def _generation(self, candidates: Sequence[TimedStimulation]) -> None:
        fresh = list(dict.fromkeys(plan for plan in candidates if plan not in self._seen))
        if not fresh:
            return
        self._seen.update(fresh)
        settings = self._settings
        first = self._score(fresh, settings.quick_seeds)
        promoted = [fresh[index] for index in np.argsort(-first, kind="stable")[: settings.promoted]]
        second = self._score(promoted, settings.full_seeds)
        self._elite += zip(second.tolist(), promoted, strict=True)
        self._elite.sort(key=lambda pair: -pair[0])
        del self._elite[settings.elite :]

    def _score(
        self, plans: Sequence[TimedStimulation], seeds: int, progress: StepProgress | None = None
    ) -> Floats:
        table = self._judge(plans, range(self._seed, self._seed + seeds), progress)
        means = np.array([np.mean([verdict.score for verdict in row]) for row in table])
        owed: Floats = self._settings.owed * np.array([len(plan.stimulation.units) for plan in plans])
        return means - owed

    def _judge(
        self, plans: Sequence[TimedStimulation], seeds: Sequence[int], progress: StepProgress | None = None
    ) -> list[list[TaskVerdict]]:
        """Verdicts of each plan on each seed."""
        self._rollouts += len(plans) * len(seeds)
        size = max(1, min(32, len(plans) // 2 + 1))
        parts = [tuple(plans[low : low + size]) for low in range(0, len(plans), size)]
        jobs = [(self._task.name, part, seed) for part in parts for seed in seeds]
        results = iter(self._pool.map(judge_task_job, jobs, progress))
        rows: list[list[TaskVerdict]] = []
        for part in parts:
            columns = [next(results) for _ in seeds]
            rows += [[column[index] for column in columns] for index in range(len(part))]
        return rows

    def _finish(self) -> TaskSearchResult:
        settings = self._settings
        finalists = [plan for _, plan in self._elite[: settings.finalists]]
        first = self._seed + _SEEDS_APART
        selected = self._judge(finalists, range(first, first + settings.selection_seeds))
        # Tasks are counted, so the choice is by successes; scores decide between equals.
        keys = [(sum(v.success for v in row), sum(v.score for v in row)) for row in selected]
        best = max(range(len(finalists)), key=keys.__getitem__)
        first = self._seed + 2 * _SEEDS_APART
        held = self._judge(
            [finalists[best], TimedStimulation()], range(first, first + settings.held_out_seeds)
        )
        return TaskSearchResult(
            self._task, finalists[best], self._elite[best][0], tuple(held[0]), tuple(held[1]), self._rollouts
        )


def judge_task_job(
    robot: Robot, policy: Policy, job: tuple[str, tuple[TimedStimulation, ...], int]
) -> list[TaskVerdict]:
    """What a worker does; tasks hold functions, so they travel by name."""
    name, plans, seed = job
    return judge_stimulations(robot, policy, robot.find_task(name), plans, seed)
