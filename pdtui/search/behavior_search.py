"""Search for a few units, and their outputs, that reach a goal, and for a rival among random ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import PlanEffects, UnitEffects
from pdtui.probing.null_distributions import sign_flip_p_values
from pdtui.probing.start_states import StartState
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.evolutionary_search import Deadline, EvolutionarySearch, EvolutionProblem, EvolutionSettings
from pdtui.search.goal_scores import measure_goal_gains, score_plans_by_goal
from pdtui.search.shared_candidates import SharedCandidates
from pdtui.search.stimulation_sampler import StimulationSampler
from pdtui.stimulation.stimulation_map import MeasuredEffect

_RIVAL_SEED = 1
"""Distinguishes the random numbers of the rival from those of the search."""
_RIVAL_LEVEL = 0.05
"""Largest corrected p-value of a stimulation that is better than its rival."""


@dataclass(frozen=True, kw_only=True)
class BehaviorSearchSettings(EvolutionSettings):
    """How much a search for a behavior does.

    Attributes:
        random_sets: random pairs and triples of units, probed once and shared by all goals.
        single_units: best single units, each at its best value, that the search begins with.
        quick_starts, quick_steps: start states and control steps of the quick score of a child,
        full_starts, full_steps: and of the full one.
        final_steps: control steps of the final score and of the held-out figures.
        satisfied: score at which a round ends early.
        safe: score from which no round with more units follows; it exceeds 1 because the full score flatters.
    """

    random_sets: int = 240
    single_units: int = 40
    quick_starts: int = 3
    quick_steps: int = 110
    full_starts: int = 8
    full_steps: int = 240
    final_steps: int = 300
    satisfied: float = 1.8
    safe: float = 1.25


@dataclass(frozen=True)
class BehaviorSearchResult:
    """The best stimulation for a goal.

    Attributes:
        goal: the goal.
        stimulation: units and outputs v.
        score: score from the held-out starts, see `score_plans_by_goal`.
        search_score: score from the starts that the search saw, which is partly luck.
        change: change of the attribute from the held-out starts, with its interval and the falls.
        gain: mean gain over the held-out starts with its interval, see `measure_goal_gains`.
        success: share of the held-out starts from which the gain was enough, without a fall.
        falls: share of the held-out starts from which the robot fell.
        value: mean of the attribute with the stimulation, from the held-out starts.
        unperturbed: mean of the attribute without it.
        rollouts: number of roll-outs of the search.
        rival: the best of as many random sets of as many units, chosen in the same stages.
        rival_gain: mean gain of the rival over the held-out starts.
        rival_p: p-value of the hypothesis that the rival gains as much, by flips of the signs of the paired
            differences; corrected for the goals of a dissection.
    """

    goal: BehaviorGoal
    stimulation: Stimulation
    score: float
    search_score: float
    change: MeasuredEffect
    gain: MeasuredEffect
    success: float
    falls: float
    value: float
    unperturbed: float
    rollouts: int
    rival: Stimulation
    rival_gain: float
    rival_p: float

    @property
    def reliable(self) -> bool:
        """Whether the stimulation reaches the goal from most of the held-out starts."""
        return self.success >= 0.5 and self.gain.effect >= self.goal.enough and self.falls <= 0.2

    @property
    def beats_rival(self) -> bool:
        """Whether the stimulation does better than what the same effort finds among random units."""
        return self.rival_p <= _RIVAL_LEVEL and self.gain.effect > self.rival_gain

    @property
    def reached(self) -> bool:
        """Whether the stimulation becomes a behavior of a map: it is reliable, and better than its rival."""
        return self.reliable and self.beats_rival


@dataclass(frozen=True)
class SearchStartStates:
    """Start states of the three stages of a search; no two stages share a walk."""

    search: tuple[StartState, ...]
    selection: tuple[StartState, ...]
    held_out: tuple[StartState, ...]


@dataclass(frozen=True)
class BehaviorSearch:
    """Search for the stimulation that reaches a goal, beginning with single units, random sets and imprints.

    Attributes:
        prober: runs the roll-outs.
        goal: what to reach.
        column: column of the goal's attribute.
        starts: start states of the stages.
        sweeps: effect curves of single units, a later one from more starts.
        shared: candidates that were probed for all goals.
        seed: seed of every random choice.
        settings: how much to do.
    """

    prober: EffectProbe
    goal: BehaviorGoal
    column: int
    starts: SearchStartStates
    sweeps: Sequence[UnitEffects]
    shared: SharedCandidates
    seed: int
    settings: BehaviorSearchSettings

    def run(self, deadline: Deadline, progress: StepProgress | None = None) -> BehaviorSearchResult:
        """Search, and measure the best stimulation and its rival from the held-out starts.

        Choosing the rival takes about as many roll-outs as the search.

        Args:
            deadline: asked between the generations of the search.
            progress: called with (generations done, generations).
        """
        rollouts_before, settings, starts = self.prober.pool.rollouts, self.settings, self.starts
        quick, full = starts.search[: settings.quick_starts], starts.search[: settings.full_starts]
        # A stop has a best possible score, since nothing stops more than entirely.
        limit = 1.0 / self.goal.enough if self.goal.aim.direction == "stop" else inf
        problem = EvolutionProblem(
            first=self._first_plans,
            vary=StimulationSampler(self._unit_weights(), settings.bounds, self.seed).vary,
            quick=partial(self._score, starts=quick, steps=settings.quick_steps),
            full=partial(self._score, starts=full, steps=settings.full_steps),
            final=partial(self._score, starts=starts.selection, steps=settings.final_steps),
            satisfied=min(settings.satisfied, 0.96 * limit),
            safe=min(settings.safe, 0.92 * limit),
        )
        search = EvolutionarySearch(problem, settings)
        search_score, stimulation = search.run(deadline, progress)
        rival = search.choose_among(self._draw_rivals(len(stimulation.units), search.tried))
        return self._measure(stimulation, rival, search_score, rollouts_before)

    def _draw_rivals(self, units: int, count: int) -> list[Stimulation]:
        """Return random sets of so many units of the policy, with outputs as large as a search can reach."""
        every_unit = np.ones(self.prober.pool.policy.units)
        bounds = replace(self.settings.bounds, drawn=self.settings.bounds.largest)
        sampler = StimulationSampler(every_unit, bounds, np.random.default_rng((self.seed, _RIVAL_SEED)))
        return [sampler.draw(units) for _ in range(count)]

    def _first_plans(self, round_: int) -> list[Stimulation]:
        """Return the best shared candidates of the round's size, and in the first round single units."""
        settings = self.settings
        singles = self._best_single_units() if round_ == 0 else []
        largest = settings.max_units[round_]
        return [*singles, *self.shared.best(self.goal, self.column, settings.children, largest)]

    def _score(self, plans: Sequence[Stimulation], starts: Sequence[StartState], steps: int) -> Floats:
        units = [len(plan.units) for plan in plans]
        return score_plans_by_goal(self.goal, self.column, self._probe(plans, starts, steps), units)

    def _probe(self, plans: Sequence[Stimulation], starts: Sequence[StartState], steps: int) -> PlanEffects:
        # The first third is the transient, which evaluation leaves out as well.
        return self.prober.measure_plans(plans, starts, steps=steps, measure_from=steps // 3)

    def _best_single_units(self) -> list[Stimulation]:
        """Return single units at values that moved the attribute the goal's way from every start."""
        gains: dict[tuple[int, float], float] = {}
        for sweep in self.sweeps:
            for (row, dose), gain in np.ndenumerate(sweep.robust_effects(self.column, self.goal.aim.sign)):
                # A later sweep measured from more starts, so it overrides an earlier one.
                gains[sweep.units[row], sweep.values[dose]] = float(gain)
        # One value per unit and sign is enough: the search scales it.
        best: dict[tuple[int, bool], tuple[int, float]] = {}
        for unit, value in sorted(gains, key=lambda single: -gains[single]):
            best.setdefault((unit, value > 0), (unit, value))
        ranked = sorted(best.values(), key=lambda single: (-gains[single], single))
        return [Stimulation((unit,), (value,)) for unit, value in ranked[: self.settings.single_units]]

    def _unit_weights(self) -> Floats:
        """Return how often to draw each unit: more often the further it moved the attribute in the sweeps."""
        weights = np.zeros(self.prober.pool.policy.units)
        for sweep in self.sweeps:
            means = self.goal.aim.sign * np.nan_to_num(sweep.effects[..., self.column]).mean(axis=-1)
            np.maximum.at(weights, np.array(sweep.units), np.maximum(means.max(axis=1), 0.0))
        return weights + (weights.mean() or 1.0)

    def _measure(
        self, best: Stimulation, rival: Stimulation, search_score: float, rollouts_before: int
    ) -> BehaviorSearchResult:
        column = self.column
        held = self._probe([best, rival], self.starts.held_out, self.settings.final_steps)
        gain, rival_gain = measure_goal_gains(self.goal, column, held)
        low, high = bootstrap_interval(gain, 0)
        effects, falls = held.effects[0, :, column], held.falls[0]
        change = MeasuredEffect(
            float(np.nanmean(effects)) if np.isfinite(effects).any() else 0.0,
            *bootstrap_interval(effects, 0),
            int(falls.sum()),
            len(falls),
        )
        return BehaviorSearchResult(
            goal=self.goal,
            stimulation=best,
            score=float(score_plans_by_goal(self.goal, column, held, [len(best.units)] * 2)[0]),
            search_score=search_score,
            change=change,
            gain=MeasuredEffect(float(gain.mean()), low, high),
            success=float(np.mean((gain >= self.goal.enough) & ~held.falls[0])),
            falls=float(held.falls[0].mean()),
            value=float(np.nanmean(held.means[0, :, column])),
            unperturbed=float(held.unperturbed[:, column].mean()),
            rollouts=self.prober.pool.rollouts - rollouts_before,
            rival=rival,
            rival_gain=float(rival_gain.mean()),
            rival_p=float(sign_flip_p_values(gain - rival_gain)),
        )
