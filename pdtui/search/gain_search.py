"""The search for a controller's gains, in a box of four numbers free of scale.

So one box serves headings, speeds and heights. The numbers are the logarithm of the limit as a multiple of
the map's; that of the error at which the proportional part alone reaches the limit, as a multiple of the
targets' steps; and the square roots of ``ki / kp`` and ``kd / kp``, with which a search can reach 0, so that
it drops a part that does not help and adds one that does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from pdtui.core.attributes import Floats
from pdtui.search.evolutionary_search import Deadline, PlanScoringStage, select_plans
from pdtui.search.stimulation_sampler import round_to_three_digits
from pdtui.stimulation.stimulation_map import PidGains

LIMIT, SATURATION, INTEGRAL, DERIVATIVE = (0.25, 4.0), (0.05, 5.0), (1 / 30, 1 / 0.3), (0.01, 1.0)
"""Bounds of the box: multiples of the map's limit, multiples of the step, 1/s, s."""
_WITHOUT = 0.5
"""Share of the points without an integral part, and share of those without a derivative part."""
_FIRST_SEEDS, _REFINED_SEEDS = 2, 3
"""Seeds of the first stage of successive halving, and of each controller that is refined."""
_STARTS = 2
"""Controllers that the Nelder-Mead method starts from: it ends in the nearest hollow, which may be bad."""
_SIMPLEX = (0.4, 0.4, 0.3, 0.15)
_FINALISTS = 6
"""Controllers that are measured on all seeds: one that falls seldom shows it only there."""


@dataclass(frozen=True)
class TuningSettings:
    """How much a search does. The one for a proportional controller does as much, with half the numbers.

    Attributes:
        points: points of the Latin hypercube.
        refinements: controllers that the Nelder-Mead method tries.
        minutes: time after which the search ends with the best controller so far; None for no limit.
    """

    points: int = 24
    refinements: int = 24
    minutes: float | None = None


class _OutOfTimeError(Exception):
    """Ends a search early."""


class GainSearch:
    """Searches the controller with the least mean cost over seeds.

    Args:
        old: the controller to begin with, from which the limit is scaled and everything but gains is taken.
        step: mean step of the targets, in the attribute's unit.
        seeds: seeds of the drives.
        costs_of: returns the costs of a controller on seeds.
        settings: how much to do.
    """

    def __init__(
        self,
        old: PidGains,
        step: float,
        seeds: Sequence[int],
        costs_of: Callable[[PidGains, Sequence[int]], list[float]],
        settings: TuningSettings,
    ) -> None:
        self._old, self._step, self._seeds, self._costs_of = old, step, seeds, costs_of
        self._settings = settings
        self._deadline: Deadline = lambda: False
        self._refined = min(_REFINED_SEEDS, len(seeds))
        self._costs: dict[PidGains, list[float]] = {}
        self.ended_early = False

    @property
    def tried(self) -> int:
        """Number of controllers measured so far."""
        return len(self._costs)

    def run(self, also: Sequence[PidGains], deadline: Deadline, *, proportional: bool = False) -> PidGains:
        """Return the best controller, without integral and derivative if it is to be only proportional.

        Those given are measured first. What an earlier run measured counts, too, so that a search of all
        gains does no worse than the one of the proportional part before it. The deadline is asked before each
        measurement.
        """
        self._deadline = deadline
        try:
            starts = self._select(also, proportional)
            for start in starts:
                self._refine(start, proportional, self._settings.refinements // len(starts))
            self._score(self._rank(proportional, self._refined)[:_FINALISTS], len(self._seeds))
        except _OutOfTimeError:
            self.ended_early = True
        counts = sorted(set(map(len, self._costs.values())), reverse=True)
        return next(ranked[0] for count in counts if (ranked := self._rank(proportional, count)))

    def _rank(self, proportional: bool, count: int) -> list[PidGains]:
        """Return the controllers that were measured on the first `count` seeds, the best on these first."""
        means = {
            pid: float(np.mean(costs[:count]))
            for pid, costs in self._costs.items()
            if len(costs) >= count and not (proportional and (pid.ki or pid.kd))
        }
        return sorted(means, key=means.__getitem__)

    def _select(self, also: Sequence[PidGains], proportional: bool) -> list[PidGains]:
        """Return the best of a hypercube and of those given; each stage keeps the better half."""
        points = sample_gain_points(self._settings.points, self._seeds[0], proportional=proportional)
        drawn = (gains_from_point(point, self._old, self._step) for point in points)
        candidates = list(dict.fromkeys([*also, *drawn]))
        return [pid for _, pid in select_plans(candidates, self._halving_stages(len(candidates)))]

    def _halving_stages(self, left: int) -> Iterator[PlanScoringStage[PidGains]]:
        count = min(_FIRST_SEEDS, self._refined)
        while count < self._refined:
            left = max(_STARTS, left // 2)
            yield PlanScoringStage(partial(self._score, count=count), left)
            count = min(2 * count, self._refined)
        yield PlanScoringStage(partial(self._score, count=count), _STARTS)

    def _score(self, candidates: Sequence[PidGains], count: int) -> list[float]:
        return [-self._measure(pid, count) for pid in candidates]

    def _refine(self, best: PidGains, proportional: bool, tries: int) -> None:
        """Refine a controller by the Nelder-Mead method."""
        start = point_from_gains(best, self._old, self._step)
        if start is None or not tries:
            return
        size = 2 if proportional else 4

        def cost(values: Floats) -> float:
            pid = gains_from_point([*values, 0.0, 0.0][:4], self._old, self._step)
            return self._measure(pid, self._refined)

        simplex = np.vstack([start[:size], start[:size] + np.diag(_SIMPLEX[:size])])
        minimize(
            cost, start[:size], method="Nelder-Mead", options={"maxfev": tries, "initial_simplex": simplex}
        )

    def _measure(self, pid: PidGains, count: int) -> float:
        """Return the cost of a controller on the first `count` seeds."""
        known = self._costs.get(pid, [])
        if len(known) < count:
            if self._costs and self._deadline():
                raise _OutOfTimeError
            self._costs[pid] = known + self._costs_of(pid, self._seeds[len(known) : count])
        return float(np.mean(self._costs[pid][:count]))


def sample_gain_points(count: int, seed: int, *, proportional: bool = False) -> Floats:
    """Return points of a Latin hypercube in the box, as `gains_from_point` takes them, shape (count, 4)."""
    drawn = qmc.LatinHypercube(6, rng=np.random.default_rng(seed)).random(count)
    lows, highs = np.log(np.array([LIMIT, SATURATION, INTEGRAL, DERIVATIVE])).T
    points: Floats = lows + drawn[:, :4] * (highs - lows)
    points[:, 2:] = np.where(drawn[:, 4:] < _WITHOUT, 0.0, np.exp(points[:, 2:] / 2))
    if proportional:
        points[:, 2:] = 0.0
    return points


def gains_from_point(point: Sequence[float] | Floats, old: PidGains, step: float) -> PidGains:
    """Return the controller that a point stands for, with gains of three significant digits.

    Args:
        point: the four numbers; 0 or less as the third or fourth leaves that part out.
        old: the map's controller, from which the limit is scaled and everything but the gains is taken.
        step: mean step of the targets, in the attribute's unit.
    """
    limit = old.limit * math.exp(point[0])
    kp = math.copysign(limit / (step * math.exp(point[1])), old.kp)
    ki, kd = (kp * max(0.0, part) ** 2 for part in point[2:])
    kp, ki, kd, limit = map(round_to_three_digits, (kp, ki, kd, limit))
    return replace(old, kp=kp, ki=ki, kd=kd, limit=limit)


def point_from_gains(pid: PidGains, old: PidGains, step: float) -> Floats | None:
    """Invert `gains_from_point` up to rounding; return None for a controller without a proportional part."""
    if pid.kp == 0.0:
        return None
    parts = [math.sqrt(max(0.0, part / pid.kp)) for part in (pid.ki, pid.kd)]
    return np.array(
        [math.log(pid.limit / old.limit), math.log(pid.limit / (abs(pid.kp) * step)), *parts], float
    )
