"""Search for the one to three units, and their outputs, that reach a goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.dissection.goals import Goal, gains, score
from pdtui.dissection.monitor import Progress, Start
from pdtui.dissection.probe import Effects, Prober, Sweep, bootstrap_interval
from pdtui.policies.units import Stimulation
from pdtui.robots.types import Floats
from pdtui.stimulation.maps import Measured

MAX_UNITS = 3
_FACTORS = (0.5, 0.7, 0.85, 1.2, 1.4, 2.0)


@dataclass(frozen=True)
class Sizes:
    """How much a search does.

    Attributes:
        atoms: single units and values from the sweeps that it combines.
        elite: candidates kept from one generation to the next.
        children: candidates of one generation.
        promoted: of them, those probed from every search start.
        generations: at most.
        patience: generations without progress before it ends.
        quick_starts, quick_steps: of the first look at a child.
        full_steps: of the second, from every search start.
        finalists: elite that the selection starts decide between.
        final_steps: stimulated control steps of the selection and of the held-out score.
        satisfied: score at which it ends early.
        largest: |v| at most.
    """

    atoms: int = 40
    elite: int = 8
    children: int = 24
    promoted: int = 6
    generations: int = 14
    patience: int = 4
    quick_starts: int = 4
    quick_steps: int = 120
    full_steps: int = 200
    finalists: int = 6
    final_steps: int = 300
    satisfied: float = 1.8
    largest: float = 20.0


@dataclass(frozen=True)
class Found:
    """The best stimulation for a goal.

    Attributes:
        goal: what it is for.
        stimulation: units and outputs v.
        score: on the held-out starts, in parts of what is enough (see `goals.score`).
        search_score: on the starts that the search saw; higher by what it owes to luck.
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


class Search:
    """Seeded greedy and local random search: start from single units, then add, swap, scale and cross.

    Each generation is looked at quickly from a few starts; the most promising are probed from all.

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
        self._starts, self._sizes = starts, sizes
        self._rng = np.random.default_rng(seed)
        self._seen: set[Stimulation] = set()
        self._elite: list[tuple[float, Stimulation]] = []
        self._began = prober.crew.rollouts

    def run(
        self, sweeps: Sequence[Sweep], deadline: Callable[[], bool], progress: Progress | None = None
    ) -> Found:
        """Search, select on other starts, and score the winner on held-out ones.

        Args:
            sweeps: single units, probed; where the search starts from.
            deadline: says when time is up.
            progress: called with (generations done, generations).
        """
        sizes = self._sizes
        atoms = self._atoms(sweeps)
        self._generation(atoms)
        idle = 0
        for number in range(sizes.generations):
            if progress is not None:
                progress(number, sizes.generations)
            best = self._elite[0][0]
            if best >= sizes.satisfied or idle >= sizes.patience or deadline():
                break
            self._generation([self._child(atoms) for _ in range(sizes.children)])
            idle = 0 if self._elite[0][0] > best + 0.01 else idle + 1
        if progress is not None:
            progress(sizes.generations, sizes.generations)
        return self._finish()

    def _atoms(self, sweeps: Sequence[Sweep]) -> list[Stimulation]:
        """Single units and values that went the goal's way from every start, the best first."""
        scored: dict[Stimulation, float] = {}
        for sweep in sweeps:
            sign = 1.0 if self._goal.aim.direction == "increase" else -1.0
            robust = sweep.robust(self._column, sign)
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

    def _child(self, atoms: Sequence[Stimulation]) -> Stimulation:
        """A changed or crossed elite that was not tried before."""
        rng = self._rng
        child = self._elite[0][1]
        for _ in range(20):
            # Squaring the uniform number favours the better parents and atoms.
            parent = self._elite[int(rng.random() ** 2 * len(self._elite))][1]
            values = dict(zip(parent.units, parent.values, strict=True))
            kind = rng.random()
            if kind < 0.35:
                values |= _as_dict(atoms[int(rng.random() ** 2 * len(atoms))])
            elif kind < 0.5:
                values |= _as_dict(self._elite[int(rng.integers(len(self._elite)))][1])
            elif kind < 0.6:
                values = {unit: v * float(rng.choice(_FACTORS)) for unit, v in values.items()}
            elif kind < 0.85:
                unit = int(rng.choice(list(values)))
                values[unit] *= float(rng.choice(_FACTORS))
            elif kind < 0.95:
                del values[int(rng.choice(list(values)))]
                values |= _as_dict(atoms[int(rng.random() ** 2 * len(atoms))])
            elif len(values) > 1:
                del values[int(rng.choice(list(values)))]
            while len(values) > MAX_UNITS:
                del values[int(rng.choice(list(values)))]
            child = _tidy(values, self._sizes.largest)
            if child not in self._seen:
                break
        return child

    def _generation(self, candidates: Sequence[Stimulation]) -> None:
        fresh = list(dict.fromkeys(plan for plan in candidates if plan not in self._seen))
        if not fresh:
            return
        self._seen.update(fresh)
        sizes = self._sizes
        quick = self._starts.search[: sizes.quick_starts]
        first = self._score(fresh, quick, sizes.quick_steps)
        promoted = [fresh[index] for index in np.argsort(-first, kind="stable")[: sizes.promoted]]
        second = self._score(promoted, self._starts.search, sizes.full_steps)
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
        return Found(
            goal=self._goal,
            stimulation=best,
            score=float(score(self._goal, column, held, [len(best.units)])[0]),
            search_score=self._elite[[plan for _, plan in self._elite].index(best)][0],
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


def _as_dict(stimulation: Stimulation) -> dict[int, float]:
    return dict(zip(stimulation.units, stimulation.values, strict=True))


def _tidy(values: dict[int, float], largest: float) -> Stimulation:
    """Units in order, values of three digits: what a map's text says is then exactly what was measured."""
    kept = {unit: float(f"{np.clip(v, -largest, largest):.3g}") for unit, v in sorted(values.items())}
    return Stimulation.of(kept)
