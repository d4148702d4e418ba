"""Search for the units, as few as it takes, and their outputs, that reach a goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.intervals import bootstrap_interval
from pdtui.core.units import Stimulation
from pdtui.probing.effect_probe import EffectProbe, PlanEffects
from pdtui.probing.start_states import StartState
from pdtui.probing.unit_effects import UnitEffects
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.behavior_goals import goal_gains, goal_scores
from pdtui.search.behavior_search_settings import BehaviorSearchSettings
from pdtui.search.shared_candidates import SharedCandidates
from pdtui.search.stimulation_sampler import StimulationSampler
from pdtui.spectra.monitor import StepProgress
from pdtui.stimulation.stimulation_map import MeasuredEffect


@dataclass(frozen=True)
class BehaviorSearchResult:
    """The best stimulation for a goal.

    Attributes:
        goal: what it is for.
        stimulation: units and outputs v.
        score: on the held-out starts, in parts of what is enough (see `goals.score`).
        search_score: on the starts that the search saw; higher by what it owes to luck.
        change: of the attribute itself on the held-out starts, with its interval and the falls.
        gain: mean over the held-out starts with its interval, as in `goals.gains`.
        success: share of the held-out starts on which it gained enough without a fall.
        falls: share of the held-out starts on which the robot fell.
        value: mean of the attribute while stimulated, held out.
        unperturbed: its mean without.
        rollouts: roll-outs that the search took.
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

    @property
    def reached(self) -> bool:
        """Whether it does what the goal asks, on starts that the search never saw: surely enough to ship."""
        return self.success >= 0.5 and self.gain.effect >= self.goal.enough and self.falls <= 0.2


@dataclass(frozen=True)
class SearchStartStates:
    """Snapshots for the three stages of a search; no walk is in two of them."""

    search: tuple[StartState, ...]
    selection: tuple[StartState, ...]
    held_out: tuple[StartState, ...]


class BehaviorSearch:
    """Seeded evolutionary search, from single units and random sets to the set that reaches a goal.

    Each generation is looked at quickly from a few starts; the most promising are probed longer and from
    more of them. A round that ends short of the goal is followed by one that may use more units.

    Args:
        prober: measures.
        goal: what to reach.
        column: of the goal's attribute.
        starts: of the three stages.
        seed: of every random choice.
        settings: how much to do.
    """

    def __init__(
        self,
        prober: EffectProbe,
        goal: BehaviorGoal,
        column: int,
        starts: SearchStartStates,
        seed: int,
        settings: BehaviorSearchSettings,
    ) -> None:
        self._prober, self._goal, self._column = prober, goal, column
        self._starts, self._settings, self._seed = starts, settings, seed
        self._seen: set[Stimulation] = set()
        self._elite: list[tuple[float, Stimulation]] = []
        self._began = prober.pool.rollouts

    def run(
        self,
        sweeps: Sequence[UnitEffects],
        pool: SharedCandidates,
        deadline: Callable[[], bool],
        progress: StepProgress | None = None,
    ) -> BehaviorSearchResult:
        """Search, select on other starts, and score the winner on held-out ones.

        Args:
            sweeps: single units, probed; the search starts from them,
            pool: and from these.
            deadline: says when time is up.
            progress: called with (generations done, generations).
        """
        settings, source = self._settings, self._candidates(sweeps)
        total = settings.generations * len(settings.max_units)
        # Nothing stops more than wholly: a stop's score has an end, and the search must know it.
        end = 1.0 / self._goal.enough if self._goal.aim.direction == "stop" else float("inf")
        satisfied, safe = min(settings.satisfied, 0.96 * end), min(settings.safe, 0.92 * end)
        for round_, most in enumerate(settings.max_units):
            first = self._best_single_units(sweeps) if round_ == 0 else []
            self._generation([*first, *pool.best(self._goal, self._column, settings.children, most)])
            idle = 0
            for number in range(settings.generations):
                if progress is not None:
                    progress(round_ * settings.generations + number, total)
                best = self._elite[0][0]
                if best >= satisfied or idle >= settings.patience or deadline():
                    break
                self._generation([self._child(source, most) for _ in range(settings.children)])
                idle = 0 if self._elite[0][0] > best + 0.01 else idle + 1
            if self._elite[0][0] >= safe:
                break
        if progress is not None:
            progress(total, total)
        return self._finish()

    def _best_single_units(self, sweeps: Sequence[UnitEffects]) -> list[Stimulation]:
        """Single units and values that went the goal's way from every start, the best first."""
        scored: dict[Stimulation, float] = {}
        for sweep in sweeps:
            robust = sweep.robust_effects(self._column, self._sign)
            for (row, dose), gain in _entries(robust):
                # Where a later sweep probed the same again from more starts, it decides.
                scored[Stimulation((sweep.units[row],), (sweep.values[dose],))] = gain
        # One value a unit and sign of v is enough: the search scales it itself.
        best: dict[tuple[int, bool], tuple[float, Stimulation]] = {}
        for atom, gain in scored.items():
            key = (atom.units[0], atom.values[0] > 0)
            if key not in best or gain > best[key][0]:
                best[key] = (gain, atom)
        ranked = sorted(best.values(), key=lambda pair: (-pair[0], pair[1].units, pair[1].values))
        return [atom for _, atom in ranked[: self._settings.single_units]]

    def _candidates(self, sweeps: Sequence[UnitEffects]) -> StimulationSampler:
        """Draws units twice as often as others where screening saw them go the goal's way, on average."""
        weights = np.zeros(self._prober.pool.policy.units)
        for sweep in sweeps:
            mean = self._sign * np.nan_to_num(sweep.effects[..., self._column]).mean(axis=-1)
            np.maximum.at(weights, np.array(sweep.units), np.maximum(mean.max(axis=1), 0.0))
        weights += weights.mean() or 1.0
        return StimulationSampler(weights, self._settings.bounds, self._seed)

    @property
    def _sign(self) -> float:
        return self._goal.aim.sign

    def _child(self, source: StimulationSampler, most: int) -> Stimulation:
        """A changed or crossed elite that was not tried before."""
        elite = [plan for _, plan in self._elite]
        most = min(most, self._prober.pool.policy.units)
        child = elite[0]
        for _ in range(20):
            parent = source.choose_parent(elite)
            if source.rng.random() < 0.25:
                child = source.cross_over(parent, source.choose_parent(elite), most)
            else:
                child = source.mutate(parent, most)
            if child not in self._seen:
                break
        return child

    def _generation(self, candidates: Sequence[Stimulation]) -> None:
        fresh = list(dict.fromkeys(plan for plan in candidates if plan not in self._seen))
        if not fresh:
            return
        self._seen.update(fresh)
        settings = self._settings
        first = self._score(fresh, self._starts.search[: settings.quick_starts], settings.quick_steps)
        promoted = [fresh[index] for index in np.argsort(-first, kind="stable")[: settings.promoted]]
        second = self._score(promoted, self._starts.search[: settings.full_starts], settings.full_steps)
        self._elite += zip(second.tolist(), promoted, strict=True)
        self._elite.sort(key=lambda pair: -pair[0])
        del self._elite[settings.elite :]

    def _probe(self, plans: Sequence[Stimulation], starts: Sequence[StartState], steps: int) -> PlanEffects:
        # The first third is the transient: evaluation leaves it out too.
        return self._prober.measure_plans(plans, starts, steps=steps, measure_from=steps // 3)

    def _score(self, plans: Sequence[Stimulation], starts: Sequence[StartState], steps: int) -> Floats:
        units = [len(plan.units) for plan in plans]
        return goal_scores(self._goal, self._column, self._probe(plans, starts, steps), units)

    def _finish(self) -> BehaviorSearchResult:
        settings, column = self._settings, self._column
        finalists = [plan for _, plan in self._elite[: settings.finalists]]
        selected = self._score(finalists, self._starts.selection, settings.final_steps)
        best = finalists[int(np.argmax(selected))]
        held = self._probe([best], self._starts.held_out, settings.final_steps)
        gain = goal_gains(self._goal, column, held)[0]
        low, high = bootstrap_interval(gain, 0)
        effects, falls = held.effects[0, :, column], held.falls[0]
        change = MeasuredEffect(
            float(np.nanmean(effects)) if np.isfinite(effects).any() else 0.0,
            *bootstrap_interval(effects, 0),
            int(falls.sum()),
            len(falls),
        )
        return BehaviorSearchResult(
            goal=self._goal,
            stimulation=best,
            score=float(goal_scores(self._goal, column, held, [len(best.units)])[0]),
            search_score=self._elite[[plan for _, plan in self._elite].index(best)][0],
            change=change,
            gain=MeasuredEffect(float(gain.mean()), low, high),
            success=float(np.mean((gain >= self._goal.enough) & ~held.falls[0])),
            falls=float(held.falls[0].mean()),
            value=float(np.nanmean(held.means[0, :, column])),
            unperturbed=float(held.unperturbed[:, column].mean()),
            rollouts=self._prober.pool.rollouts - self._began,
        )


def _entries(table: Floats) -> list[tuple[tuple[int, int], float]]:
    rows, columns = table.shape
    return [((row, column), float(table[row, column])) for row in range(rows) for column in range(columns)]
