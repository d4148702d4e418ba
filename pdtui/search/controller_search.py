"""Search for a unit through which a PID controller holds an attribute at a target."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import ControllerPlan
from pdtui.probing.unit_effects import UnitEffects
from pdtui.search.stimulation_sampler import round_to_three_digits
from pdtui.stimulation.stimulation_map import PidGains

_FALL = 2.0


@dataclass(frozen=True)
class ControllerSearchResult:
    """The best controller for an attribute.

    Attributes:
        weights: units, and how much of the controller's output each is overwritten with.
        base: what is added to it, in the order of the units.
        pid: gains.
        error: mean distance from the targets over the held-out starts, in the attribute's unit.
        uncontrolled: the same distance without stimulation.
        falls: share of the held-out roll-outs on which the robot fell.
        targets: those that it was measured at.
        relative: whether they count from the value at the start.
    """

    weights: Stimulation
    pid: PidGains
    error: float
    uncontrolled: float
    falls: float
    targets: tuple[float, ...]
    relative: bool
    base: tuple[float, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether it more than halves the distance and seldom falls."""
        return self.error < 0.5 * self.uncontrolled and self.falls <= 0.1


@dataclass(frozen=True)
class ControllerSearchSettings:
    """How much a search does.

    Attributes:
        units: tried alone.
        pairs: opposite plans on the same units, tried as the two ends of a controller's range.
        finalists: that the second stage decides between.
        steps, final_steps: control steps of either stage.
    """

    units: int = 10
    pairs: int = 6
    finalists: int = 10
    steps: int = 150
    final_steps: int = 300


@dataclass(frozen=True)
class ControllerGoal:
    """What is to be held.

    Attributes:
        attribute: its name. An angle integrates by itself; of anything else an integral gain is tried, which
            it needs to settle where the output is not zero.
        targets: to reach, in the attribute's unit.
        relative: whether they count from the value at the start.
    """

    attribute: str
    targets: tuple[float, ...]
    relative: bool

    @property
    def spread(self) -> float:
        """Size of the errors that the controller will meet, in the attribute's unit."""
        size = np.mean(np.abs(self.targets)) if self.relative else np.ptp(self.targets)
        return float(size) or 1.0


class _Candidate(NamedTuple):
    weights: Stimulation
    base: tuple[float, ...]
    pid: PidGains


class ControllerSearch:
    """Tries controllers on units whose effect grows most evenly with v, and between opposite plans.

    Args:
        prober: measures.
        aimed: what is to be held, and where.
        settings: how much to do.
    """

    def __init__(
        self, prober: EffectProbe, aimed: ControllerGoal, settings: ControllerSearchSettings
    ) -> None:
        self._prober, self._aimed, self._settings = prober, aimed, settings

    def run(
        self,
        sweep: UnitEffects,
        column: int,
        opposites: Sequence[tuple[Stimulation, Stimulation]],
        search: Sequence[StartState],
        held_out: Sequence[StartState],
        deadline: Callable[[], bool],
    ) -> ControllerSearchResult | None:
        """The best controller, or None where nothing moves the attribute or the time is up.

        Args:
            sweep: effect curves.
            column: of the attribute.
            opposites: plans on the same units that raise and lower the attribute.
            search: starts of the search.
            held_out: starts that the search does not see; the first half of them decides between the
                finalists, the other half gives the figures.
            deadline: says when time is up.
        """
        settings = self._settings
        candidates = self._alone(_steerers(sweep, column)[: settings.units])
        candidates += self._between(opposites[: settings.pairs])
        if not candidates or deadline():
            return None
        cost = self._cost(candidates, search, settings.steps)
        finalists = [candidates[index] for index in np.argsort(cost, kind="stable")[: settings.finalists]]
        half = len(held_out) // 2
        cost = self._cost(finalists, held_out[:half], settings.final_steps)
        best = finalists[int(np.argmin(cost))]
        without = _Candidate(NO_STIMULATION, (), best.pid)
        errors, falls = self._measure([best, without], held_out[half:], settings.final_steps)
        aimed = self._aimed
        return ControllerSearchResult(
            best.weights,
            best.pid,
            float(errors[0]),
            float(errors[1]),
            float(falls[0]),
            aimed.targets,
            aimed.relative,
            best.base,
        )

    def _alone(self, units: Sequence[tuple[int, float]]) -> list[_Candidate]:
        """Single units, from 0 either way."""
        return [
            _Candidate(Stimulation((unit,), (weight,)), (), self._pid(limit, gain * limit, ki))
            for unit, weight in units
            for limit in (2.0, 4.0, 8.0)
            for gain in (1.0, 3.0)
            for ki in self._integral
        ]

    def _between(self, opposites: Sequence[tuple[Stimulation, Stimulation]]) -> list[_Candidate]:
        """From one plan, at −1, to its opposite, at 1, and a little beyond."""
        found = []
        for high, low in opposites:
            up, down = np.array(high.values), np.array(low.values)
            weights = Stimulation(high.units, _rounded((up - down) / 2))
            base = _rounded((up + down) / 2)
            found += [
                _Candidate(weights, base, self._pid(limit, gain, ki))
                for limit in (1.0, 1.5, 3.0)
                for gain in (1.0, 2.0, 4.0)
                for ki in self._integral
            ]
        return found

    @property
    def _integral(self) -> tuple[float, ...]:
        return (0.0,) if self._aimed.relative else (0.5, 2.0)

    def _pid(self, limit: float, gain: float, ki: float) -> PidGains:
        """A gain of 1 puts out 1 at the errors that the controller will meet."""
        kp = round_to_three_digits(gain / self._aimed.spread)
        step = float(f"{self._aimed.spread / 4:.1g}")
        return PidGains(self._aimed.attribute, kp, round_to_three_digits(kp * ki), 0.0, limit, step)

    def _cost(self, candidates: Sequence[_Candidate], starts: Sequence[StartState], steps: int) -> Floats:
        errors, falls = self._measure(candidates, starts, steps)
        cost: Floats = errors + _FALL * self._aimed.spread * falls
        return cost

    def _measure(
        self, candidates: Sequence[_Candidate], starts: Sequence[StartState], steps: int
    ) -> tuple[Floats, Floats]:
        """Mean error and share of falls of each candidate over targets and starts."""
        aimed = self._aimed
        plans = [
            ControllerPlan(one.weights, one.pid, target, aimed.relative, one.base)
            for one in candidates
            for target in aimed.targets
        ]
        result = self._prober.measure_plans(plans, starts, steps=steps, measure_from=steps // 3)
        # Whoever fell before the measured steps held nothing: it counts as the largest target.
        errors = np.nan_to_num(result.errors, nan=float(np.max(np.abs(aimed.targets))))
        shape = (len(candidates), -1)
        return errors.reshape(shape).mean(axis=1), result.falls.reshape(shape).mean(axis=1)


def _steerers(sweep: UnitEffects, column: int) -> list[tuple[int, float]]:
    """Units with the sign of their slope, those with the steepest and straightest curves first."""
    values = np.array(sweep.values)
    curves = np.nan_to_num(sweep.effects[..., column].mean(axis=2))
    curves = np.where(sweep.falls.any(axis=2), 0.0, curves)
    slope = curves @ values
    order = np.argsort(-np.abs(slope), kind="stable")
    return [(sweep.units[row], float(np.sign(slope[row]))) for row in order if slope[row] != 0]


def _rounded(values: Floats) -> tuple[float, ...]:
    return tuple(round_to_three_digits(value) for value in values.tolist())
