"""Search for the units, as few as it takes, and their outputs, that reach a goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pdtui.dissection.candidates import Bounds, Candidates
from pdtui.dissection.goals import Goal, gains, score
from pdtui.dissection.monitor import Progress, Start
from pdtui.dissection.probe import Effects, Prober, Sweep, bootstrap_interval
from pdtui.policies.units import Stimulation
from pdtui.robots.types import Floats
from pdtui.stimulation.maps import Measured


@dataclass(frozen=True)
class Sizes:
    """How much a search does.

    Attributes:
        pool: random pairs and triples, probed once and shared by all goals.
        atoms: single units and values from the sweeps that it combines.
        elite: candidates kept from one generation to the next.
        children: candidates of one generation.
        promoted: of them, those probed from more starts.
        most_units: units of a candidate at most, in the first round and in those that follow where the goal
            was not reached: a behavior of many units is a direction in a layer.
        generations: of one round, at most.
        patience: generations without progress before a round ends.
        quick_starts, quick_steps: of the first look at a child.
        full_starts, full_steps: of the second.
        finalists: elite that the selection starts decide between.
        final_steps: stimulated control steps of the selection and of the held-out score.
        satisfied: score at which it ends early.
        safe: score from which no round with more units follows: what the search sees flatters a little.
        bounds: of the outputs v.
    """

    pool: int = 240
    atoms: int = 40
    elite: int = 16
    children: int = 28
    promoted: int = 8
    most_units: tuple[int, ...] = (3, 8, 24, 64)
    generations: int = 24
    patience: int = 6
    quick_starts: int = 3
    quick_steps: int = 110
    full_starts: int = 8
    full_steps: int = 240
    finalists: int = 6
    final_steps: int = 300
    satisfied: float = 1.8
    safe: float = 1.25
    bounds: Bounds = field(default_factory=Bounds)


@dataclass(frozen=True)
class Found:
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

    goal: Goal
    stimulation: Stimulation
    score: float
    search_score: float
    change: Measured
    gain: Measured
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
class Starts:
    """Snapshots for the three stages of a search; no walk is in two of them."""

    search: tuple[Start, ...]
    selection: tuple[Start, ...]
    held_out: tuple[Start, ...]


class Pool:
    """Sets of units, probed once for all goals: where searches begin when no single unit leads the way.

    Args:
        prober: measures.
        plans: what to probe.
        starts: a few of the search starts.
        steps: control steps of each roll-out.
        progress: called with (roll-outs done, roll-outs).
    """

    def __init__(
        self,
        prober: Prober,
        plans: Sequence[Stimulation],
        starts: Sequence[Start],
        steps: int,
        progress: Progress | None = None,
    ) -> None:
        self.plans = tuple(plans)
        self.effects = prober.probe(
            self.plans, starts, steps=steps, measure_from=steps // 3, progress=progress
        )

    def best(self, goal: Goal, column: int, count: int, most: int) -> list[Stimulation]:
        """Those of at most so many units that went the goal's way furthest."""
        if not self.plans:
            return []
        scored = score(goal, column, self.effects, [len(plan.units) for plan in self.plans])
        order = [int(index) for index in np.argsort(-scored, kind="stable")]
        return [self.plans[index] for index in order if len(self.plans[index].units) <= most][:count]

    def opposites(self, column: int, count: int) -> list[tuple[Stimulation, Stimulation]]:
        """Pairs of plans on the same units that raise and lower an attribute, the strongest pairs first.

        A pair is as strong as its weaker side; plans that fell are left out.
        """
        effect = np.nan_to_num(self.effects.effects[..., column]).mean(axis=1)
        effect[self.effects.falls.any(axis=1)] = 0.0
        same: dict[tuple[int, ...], list[int]] = {}
        for index, plan in enumerate(self.plans):
            same.setdefault(plan.units, []).append(index)
        pairs = []
        for indices in same.values():
            high, low = max(indices, key=lambda i: effect[i]), min(indices, key=lambda i: effect[i])
            strength = min(float(effect[high]), -float(effect[low]))
            if strength > 0:
                pairs.append((strength, self.plans[high], self.plans[low]))
        pairs.sort(key=lambda pair: (-pair[0], pair[1].units))
        return [(high, low) for _, high, low in pairs[:count]]


def random_sets(units: int, sizes: Sizes, seed: int) -> list[Stimulation]:
    """Pairs and triples of units, drawn at random."""
    source = Candidates(np.ones(units), sizes.bounds, seed)
    most = min(3, units)
    return [source.draw(int(source.rng.integers(min(2, most), most + 1))) for _ in range(sizes.pool)]


class Search:
    """Seeded evolutionary search, from single units and random sets to the set that reaches a goal.

    Each generation is looked at quickly from a few starts; the most promising are probed longer and from
    more of them. A round that ends short of the goal is followed by one that may use more units.

    Args:
        prober: measures.
        goal: what to reach.
        column: of the goal's attribute.
        starts: of the three stages.
        seed: of every random choice.
        sizes: how much to do.
    """

    def __init__(
        self, prober: Prober, goal: Goal, column: int, starts: Starts, seed: int, sizes: Sizes
    ) -> None:
        self._prober, self._goal, self._column = prober, goal, column
        self._starts, self._sizes, self._seed = starts, sizes, seed
        self._seen: set[Stimulation] = set()
        self._elite: list[tuple[float, Stimulation]] = []
        self._began = prober.crew.rollouts

    def run(
        self,
        sweeps: Sequence[Sweep],
        pool: Pool,
        deadline: Callable[[], bool],
        progress: Progress | None = None,
    ) -> Found:
        """Search, select on other starts, and score the winner on held-out ones.

        Args:
            sweeps: single units, probed; the search starts from them,
            pool: and from these.
            deadline: says when time is up.
            progress: called with (generations done, generations).
        """
        sizes, source = self._sizes, self._candidates(sweeps)
        total = sizes.generations * len(sizes.most_units)
        for round_, most in enumerate(sizes.most_units):
            first = self._atoms(sweeps) if round_ == 0 else []
            self._generation([*first, *pool.best(self._goal, self._column, sizes.children, most)])
            idle = 0
            for number in range(sizes.generations):
                if progress is not None:
                    progress(round_ * sizes.generations + number, total)
                best = self._elite[0][0]
                if best >= sizes.satisfied or idle >= sizes.patience or deadline():
                    break
                self._generation([self._child(source, most) for _ in range(sizes.children)])
                idle = 0 if self._elite[0][0] > best + 0.01 else idle + 1
            if self._elite[0][0] >= sizes.safe:
                break
        if progress is not None:
            progress(total, total)
        return self._finish()

    def _atoms(self, sweeps: Sequence[Sweep]) -> list[Stimulation]:
        """Single units and values that went the goal's way from every start, the best first."""
        scored: dict[Stimulation, float] = {}
        for sweep in sweeps:
            robust = sweep.robust(self._column, self._sign)
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
        return [atom for _, atom in ranked[: self._sizes.atoms]]

    def _candidates(self, sweeps: Sequence[Sweep]) -> Candidates:
        """Draws units twice as often as others where screening saw them go the goal's way, on average."""
        weights = np.zeros(self._prober.crew.policy.units)
        for sweep in sweeps:
            mean = self._sign * np.nan_to_num(sweep.effects[..., self._column]).mean(axis=-1)
            np.maximum.at(weights, np.array(sweep.units), np.maximum(mean.max(axis=1), 0.0))
        weights += weights.mean() or 1.0
        return Candidates(weights, self._sizes.bounds, self._seed)

    @property
    def _sign(self) -> float:
        return 1.0 if self._goal.aim.direction == "increase" else -1.0

    def _child(self, source: Candidates, most: int) -> Stimulation:
        """A changed or crossed elite that was not tried before."""
        elite = [plan for _, plan in self._elite]
        most = min(most, self._prober.crew.policy.units)
        child = elite[0]
        for _ in range(20):
            parent = source.favourite(elite)
            if source.rng.random() < 0.25:
                child = source.cross(parent, source.favourite(elite), most)
            else:
                child = source.change(parent, most)
            if child not in self._seen:
                break
        return child

    def _generation(self, candidates: Sequence[Stimulation]) -> None:
        fresh = list(dict.fromkeys(plan for plan in candidates if plan not in self._seen))
        if not fresh:
            return
        self._seen.update(fresh)
        sizes = self._sizes
        first = self._score(fresh, self._starts.search[: sizes.quick_starts], sizes.quick_steps)
        promoted = [fresh[index] for index in np.argsort(-first, kind="stable")[: sizes.promoted]]
        second = self._score(promoted, self._starts.search[: sizes.full_starts], sizes.full_steps)
        self._elite += zip(second.tolist(), promoted, strict=True)
        self._elite.sort(key=lambda pair: -pair[0])
        del self._elite[sizes.elite :]

    def _probe(self, plans: Sequence[Stimulation], starts: Sequence[Start], steps: int) -> Effects:
        # The first third is the transient: evaluation leaves it out too.
        return self._prober.probe(plans, starts, steps=steps, measure_from=steps // 3)

    def _score(self, plans: Sequence[Stimulation], starts: Sequence[Start], steps: int) -> Floats:
        units = [len(plan.units) for plan in plans]
        return score(self._goal, self._column, self._probe(plans, starts, steps), units)

    def _finish(self) -> Found:
        sizes, column = self._sizes, self._column
        finalists = [plan for _, plan in self._elite[: sizes.finalists]]
        selected = self._score(finalists, self._starts.selection, sizes.final_steps)
        best = finalists[int(np.argmax(selected))]
        held = self._probe([best], self._starts.held_out, sizes.final_steps)
        gain = gains(self._goal, column, held)[0]
        low, high = bootstrap_interval(gain, 0)
        effects, falls = held.effects[0, :, column], held.falls[0]
        change = Measured(
            float(np.nanmean(effects)) if np.isfinite(effects).any() else 0.0,
            *bootstrap_interval(effects, 0),
            int(falls.sum()),
            len(falls),
        )
        return Found(
            goal=self._goal,
            stimulation=best,
            score=float(score(self._goal, column, held, [len(best.units)])[0]),
            search_score=self._elite[[plan for _, plan in self._elite].index(best)][0],
            change=change,
            gain=Measured(float(gain.mean()), low, high),
            success=float(np.mean((gain >= self._goal.enough) & ~held.falls[0])),
            falls=float(held.falls[0].mean()),
            value=float(np.nanmean(held.means[0, :, column])),
            unperturbed=float(held.unperturbed[:, column].mean()),
            rollouts=self._prober.crew.rollouts - self._began,
        )


def _entries(table: Floats) -> list[tuple[tuple[int, int], float]]:
    rows, columns = table.shape
    return [((row, column), float(table[row, column])) for row in range(rows) for column in range(columns)]
