"""The searches of one dissection: a behavior for each goal, a controller for what can be held."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.units import Stimulation
from pdtui.dissection.dissection_settings import DissectionSettings
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.unit_effects import UnitEffects
from pdtui.robots.robot import Robot
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.behavior_goals import STANDING, reachable_goals
from pdtui.search.behavior_search import BehaviorSearch, BehaviorSearchResult, SearchStartStates
from pdtui.search.controller_search import ControllerGoal, ControllerSearch, ControllerSearchResult
from pdtui.search.imprint_candidates import build_imprint_candidates
from pdtui.search.shared_candidates import SharedCandidates, draw_random_candidates
from pdtui.spectra.monitor import StepProgress, monitor_episodes

_IMPRINT_SEEDS = 1000
"""Beyond the first seed of a dissection: no other stage has these."""


class TimeBudget:
    """Shares what is left of a time budget fairly among the searches to come."""

    def __init__(self, began: float, minutes: float | None) -> None:
        self._end = None if minutes is None else began + 60 * minutes

    def share(self, left: int) -> Callable[[], bool]:
        """Whether the next search's part of the time is over, when `left` searches are still to run."""
        if self._end is None:
            return lambda: False
        now = time.monotonic()
        until = now + max(0.0, self._end - now) / max(1, left)
        return lambda: time.monotonic() >= until


@dataclass(frozen=True)
class DissectionSearches:
    """What all searches of one dissection share.

    Attributes:
        prober: measures.
        world: the robot, for its attributes.
        plan: how much to do.
        seed: of every random choice.
        clock: shares the time.
        stage: gives the progress callback of a stage, by its name.
        known: sets of units from elsewhere, where searches begin too.
    """

    prober: EffectProbe
    world: Robot
    plan: DissectionSettings
    seed: int
    clock: TimeBudget
    stage: Callable[[str], StepProgress | None]
    known: Sequence[Stimulation] = ()

    def run(
        self, screen: UnitEffects, refined: UnitEffects, starts: SearchStartStates
    ) -> tuple[tuple[BehaviorSearchResult, ...], tuple[ControllerSearchResult, ...]]:
        """A behavior for each goal, and a controller for each attribute, that means anything here."""
        goals, targets = reachable_goals(self.world, refined.unperturbed), self._targets(refined)
        if not goals and not targets:
            return (), ()
        pool = self.pool(starts)
        return self._behaviors(goals, (screen, refined), pool, starts), self._holds(
            targets, refined, pool, starts
        )

    def _behaviors(
        self,
        goals: Sequence[BehaviorGoal],
        sweeps: Sequence[UnitEffects],
        pool: SharedCandidates,
        starts: SearchStartStates,
    ) -> tuple[BehaviorSearchResult, ...]:
        found = []
        for number, goal in enumerate(goals):
            column = self.world.attribute_index(goal.aim.attribute)
            search = BehaviorSearch(
                self.prober, goal, column, starts, self.seed + number, self.plan.behavior_search
            )
            deadline = self.clock.share(len(goals) - number + 2)
            found.append(search.run(sweeps, pool, deadline, self.stage(f"search: {goal.name}")))
        return tuple(found)

    def pool(self, starts: SearchStartStates) -> SharedCandidates:
        """Random sets and imprints, probed once for all searches."""
        crew, sizes, imprint = self.prober.pool, self.plan.behavior_search, self.plan.imprints
        seeds = range(self.seed + _IMPRINT_SEEDS, self.seed + _IMPRINT_SEEDS + imprint.episodes)
        episodes = monitor_episodes(self.world, crew.policy, seeds, imprint.steps)
        plans = [
            *self.known,
            *draw_random_candidates(crew.policy.units, sizes, self.seed),
            *build_imprint_candidates(
                episodes, self.world.attributes, crew.policy.layers, imprint, sizes.bounds.largest
            ),
        ]
        few = starts.search[: sizes.quick_starts]
        return SharedCandidates(self.prober, plans, few, sizes.quick_steps, self.stage("sets of units"))

    def _targets(self, sweep: UnitEffects) -> list[ControllerGoal]:
        """What the robot's goals hold; a robot that stands has no share of its speed to hold."""
        names = [attribute.name for attribute in self.world.attributes]
        wanted = []
        for goal in self.world.goals.holds:
            if goal.attribute not in names:
                continue
            if goal.relative_to == "start":
                wanted.append(ControllerGoal(goal.attribute, goal.targets, True))
                continue
            usual = float(np.mean(sweep.unperturbed[:, names.index(goal.attribute)]))
            if usual > STANDING:
                targets = tuple(share * usual for share in goal.targets)
                wanted.append(ControllerGoal(goal.attribute, targets, False))
        return wanted

    def _holds(
        self,
        targets: Sequence[ControllerGoal],
        sweep: UnitEffects,
        pool: SharedCandidates,
        starts: SearchStartStates,
    ) -> tuple[ControllerSearchResult, ...]:
        """The best controllers, as long as the time is not up."""
        held = []
        for number, target in enumerate(targets):
            column = self.world.attribute_index(target.attribute)
            deadline = self.clock.share(len(targets) - number)
            search, held_out = starts.search[:4], (*starts.selection[:6], *starts.held_out[:6])
            searcher = ControllerSearch(self.prober, target, self.plan.controller_search)
            opposites = pool.opposites(column, self.plan.controller_search.pairs)
            held.append(searcher.run(sweep, column, opposites, search, held_out, deadline))
            progress = self.stage(f"search: hold {target.attribute}")
            if progress is not None:
                progress(1, 1)
        return tuple(one for one in held if one is not None)
