"""The searches of one dissection: a behavior for each goal, a controller for what can be held."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation
from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.null_distributions import correct_for_comparisons
from pdtui.robots.robot import Robot
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.behavior_search import BehaviorSearch, BehaviorSearchResult, SearchStartStates
from pdtui.search.controller_search import ControllerGoal, ControllerSearch, ControllerSearchResult
from pdtui.search.evolutionary_search import SharedTimeBudget
from pdtui.search.goal_scores import STANDING, reachable_goals
from pdtui.search.imprint_candidates import build_imprint_candidates
from pdtui.search.shared_candidates import SharedCandidates, sample_random_candidates
from pdtui.search.task_search import TaskSearch, TaskSearchResult
from pdtui.spectra.episode_monitor import monitor_episodes

_IMPRINT_SEEDS = 1000
"""Offset of the imprints' seeds from the first seed of a dissection; no other stage uses them."""
_CONTROLLER_SHARES = 2
"""Shares of the time that the behaviors leave to the controllers."""
_TASK_SEEDS = 10_000
"""Offset of the seeds of searches for tasks from the first seed of a dissection."""
_SEEDS_PER_TASK = 2000
_BEHAVIOR_SHARES = 2
"""Shares of a behavior: the search ends after one, and choosing its rival takes about as long."""


@dataclass(frozen=True)
class DissectionSearches:
    """The searches of one dissection, and what they share.

    Attributes:
        budget: shares the time among the searches.
        stage: returns the progress callback of a stage, given its name.
        known: stimulations to begin with besides those that are drawn.
    """

    prober: EffectProbe
    robot: Robot
    settings: DissectionSettings
    seed: int
    budget: SharedTimeBudget
    stage: Callable[[str], StepProgress | None]
    known: Sequence[Stimulation] = ()

    def run(
        self, screen: UnitEffects, refined: UnitEffects, starts: SearchStartStates
    ) -> tuple[tuple[BehaviorSearchResult, ...], tuple[ControllerSearchResult, ...]]:
        """Search for behaviors and controllers, as far as the robot has the attributes."""
        goals = reachable_goals(self.robot, refined.unperturbed)
        controller_goals = self._controller_goals(refined)
        if not goals and not controller_goals:
            return (), ()
        shared = self.probe_shared_candidates(starts)
        behaviors = self._search_behaviors(goals, (screen, refined), shared, starts)
        return behaviors, self._search_controllers(controller_goals, refined, shared, starts)

    def search_units_for_tasks(self, units: Sequence[int]) -> tuple[TaskSearchResult, ...]:
        """Search for what does the tasks that the robot's goals name.

        Args:
            units: flat indices of the units that the searches try alone.
        """
        results, names = [], self.robot.goals.tasks
        for number, name in enumerate(names):
            search = TaskSearch(
                self.prober.pool,
                self.robot.find_task(name),
                self.seed + _TASK_SEEDS + number * _SEEDS_PER_TASK,
                self.settings.task_search,
                units=units,
            )
            deadline = self.budget.share(len(names) - number)
            results.append(search.run(deadline, self.stage(f"search: {name}")))
        return tuple(results)

    def probe_shared_candidates(self, starts: SearchStartStates) -> SharedCandidates:
        """Probe random sets and imprints, once for all searches."""
        policy, imprints = self.prober.pool.policy, self.settings.imprints
        settings = self.settings.behavior_search
        first = self.seed + _IMPRINT_SEEDS
        walks = monitor_episodes(self.robot, policy, range(first, first + imprints.episodes), imprints.steps)
        plans = [
            *self.known,
            *sample_random_candidates(policy.units, settings.random_sets, settings.bounds, self.seed),
            *build_imprint_candidates(
                walks, self.robot.attributes, policy.layers, imprints, settings.bounds.largest
            ),
        ]
        few, progress = starts.search[: settings.quick_starts], self.stage("sets of units")
        return SharedCandidates(self.prober, plans, few, settings.quick_steps, progress)

    def _search_behaviors(
        self,
        goals: Sequence[BehaviorGoal],
        sweeps: Sequence[UnitEffects],
        shared: SharedCandidates,
        starts: SearchStartStates,
    ) -> tuple[BehaviorSearchResult, ...]:
        results = []
        for number, goal in enumerate(goals):
            column, seed = self.robot.attribute_index(goal.aim.attribute), self.seed + number
            search = BehaviorSearch(
                self.prober, goal, column, starts, sweeps, shared, seed, self.settings.behavior_search
            )
            left = _BEHAVIOR_SHARES * (len(goals) - number)
            deadline = self.budget.share(left + _CONTROLLER_SHARES)
            results.append(search.run(deadline, self.stage(f"search: {goal.name}")))
        corrected = correct_for_comparisons([one.rival_p for one in results]).tolist()
        return tuple(replace(one, rival_p=p) for one, p in zip(results, corrected, strict=True))

    def _controller_goals(self, sweep: UnitEffects) -> list[ControllerGoal]:
        """Return what the robot's goals hold; a robot that stands has no share of its speed to hold."""
        names = [attribute.name for attribute in self.robot.attributes]
        goals = []
        for goal in self.robot.goals.holds:
            if goal.attribute not in names:
                continue
            if goal.relative_to == "start":
                goals.append(ControllerGoal(goal.attribute, goal.targets, True))
                continue
            usual = float(np.mean(sweep.unperturbed[:, names.index(goal.attribute)]))
            if usual > STANDING:
                targets = tuple(share * usual for share in goal.targets)
                goals.append(ControllerGoal(goal.attribute, targets, False))
        return goals

    def _search_controllers(
        self,
        goals: Sequence[ControllerGoal],
        sweep: UnitEffects,
        shared: SharedCandidates,
        starts: SearchStartStates,
    ) -> tuple[ControllerSearchResult, ...]:
        settings, results = self.settings.controller_search, []
        search, held_out = starts.search[:4], (*starts.selection[:6], *starts.held_out[:6])
        for number, goal in enumerate(goals):
            column = self.robot.attribute_index(goal.attribute)
            opposites = shared.opposites(column, settings.pairs)
            searcher = ControllerSearch(self.prober, goal, settings)
            deadline = self.budget.share(len(goals) - number)
            results.append(searcher.run(sweep, column, opposites, search, held_out, deadline))
            progress = self.stage(f"search: hold {goal.attribute}")
            if progress is not None:
                progress(1, 1)
        return tuple(result for result in results if result is not None)
