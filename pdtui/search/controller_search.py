"""Search for units through which a PID controller holds an attribute at a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import PidStimulationPlan
from pdtui.search.evolutionary_search import Deadline, PlanScoringStage, select_plans
from pdtui.search.stimulation_sampler import round_outputs, round_to_three_digits
from pdtui.stimulation.stimulation_map import PidGains

_FALL_PENALTY = 2.0
"""Penalty for a fall, in multiples of the typical error."""


@dataclass(frozen=True)
class ControllerSearchResult:
    """The best controller for an attribute.

    Attributes:
        weights: units, with the factor from the controller's output to each unit's output.
        pid: gains of the controller.
        error: mean distance from the targets over the held-out starts, in the attribute's unit.
        uncontrolled: the same distance without stimulation.
        falls: share of the held-out roll-outs on which the robot fell.
        targets: targets of the measurement.
        relative: whether they are offsets from the value at the start.
        base: outputs of the units where the controller's output is 0; empty for zeros.
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
        """Whether the controller at least halves the distance and the robot seldom falls."""
        return self.error < 0.5 * self.uncontrolled and self.falls <= 0.1


@dataclass(frozen=True)
class ControllerSearchSettings:
    """How much a search for a controller does.

    Attributes:
        units: number of units to try alone.
        pairs: number of pairs of opposite plans to try as the two ends of a controller's range.
        finalists: candidates that the second stage decides between.
        steps, final_steps: control steps of a roll-out in the first and the second stage.
    """

    units: int = 10
    pairs: int = 6
    finalists: int = 10
    steps: int = 150
    final_steps: int = 300


@dataclass(frozen=True)
class ControllerGoal:
    """An attribute to hold, and where.

    Attributes:
        attribute: name of the attribute.
        targets: targets, in the attribute's unit.
        relative: whether they are offsets from the value at the start.
    """

    attribute: str
    targets: tuple[float, ...]
    relative: bool

    @property
    def spread(self) -> float:
        """Typical size of the errors that the controller will see, in the attribute's unit."""
        size = np.mean(np.abs(self.targets)) if self.relative else np.ptp(self.targets)
        return float(size) or 1.0


@dataclass(frozen=True)
class ControllerSearch:
    """Try controllers on the units whose effect is most linear in v, and between opposite plans.

    Attributes:
        prober: runs the roll-outs.
        goal: what to hold, and where.
        settings: how much to do.
    """

    prober: EffectProbe
    goal: ControllerGoal
    settings: ControllerSearchSettings

    def run(
        self,
        sweep: UnitEffects,
        column: int,
        opposites: Sequence[tuple[Stimulation, Stimulation]],
        search: Sequence[StartState],
        held_out: Sequence[StartState],
        deadline: Deadline,
    ) -> ControllerSearchResult | None:
        """Return the best controller, or None if nothing moves the attribute or the time is over.

        Args:
            sweep: effect curves of single units.
            column: column of the attribute.
            opposites: pairs of plans on the same units that raise and lower the attribute.
            search: start states of the first stage.
            held_out: start states that the first stage does not see; one half decides between the finalists,
                the other gives the figures.
            deadline: asked before the first roll-out.
        """
        settings = self.settings
        candidates = self._alone(_rank_by_slope(sweep, column)[: settings.units])
        candidates += self._between(opposites[: settings.pairs])
        if not candidates or deadline():
            return None
        half = len(held_out) // 2
        stages = (
            PlanScoringStage(partial(self._score, starts=search, steps=settings.steps), settings.finalists),
            PlanScoringStage(partial(self._score, starts=held_out[:half], steps=settings.final_steps), 1),
        )
        ((_, best),) = select_plans(candidates, stages)
        without = replace(best, units=NO_STIMULATION, base=())
        errors, falls = self._measure([best, without], held_out[half:], settings.final_steps)
        targets, relative = self.goal.targets, self.goal.relative
        return ControllerSearchResult(
            best.units,
            best.pid,
            float(errors[0]),
            float(errors[1]),
            float(falls[0]),
            targets,
            relative,
            best.base,
        )

    def _alone(self, units: Sequence[tuple[int, float]]) -> list[PidStimulationPlan]:
        """Propose single units, whose output goes either way from 0."""
        return [
            self._candidate(Stimulation((unit,), (weight,)), (), limit, gain * limit, ki)
            for unit, weight in units
            for limit in (2.0, 4.0, 8.0)
            for gain in (1.0, 3.0)
            for ki in self._integral
        ]

    def _between(self, opposites: Sequence[tuple[Stimulation, Stimulation]]) -> list[PidStimulationPlan]:
        """Propose blends from one plan, at −1, to its opposite, at 1, and somewhat beyond."""
        found = []
        for high, low in opposites:
            up, down = np.array(high.values), np.array(low.values)
            weights = Stimulation(high.units, round_outputs((up - down) / 2))
            base = round_outputs((up + down) / 2)
            found += [
                self._candidate(weights, base, limit, gain, ki)
                for limit in (1.0, 1.5, 3.0)
                for gain in (1.0, 2.0, 4.0)
                for ki in self._integral
            ]
        return found

    @property
    def _integral(self) -> tuple[float, ...]:
        # An angle is the integral of what the units change; anything else needs an integral part to settle.
        return (0.0,) if self.goal.relative else (0.5, 2.0)

    def _candidate(
        self, units: Stimulation, base: tuple[float, ...], limit: float, gain: float, ki: float
    ) -> PidStimulationPlan:
        """Scale the gains so that a gain of 1 gives an output of 1 for a typical error."""
        spread = self.goal.spread
        kp, step = round_to_three_digits(gain / spread), float(f"{spread / 4:.1g}")
        pid = PidGains(self.goal.attribute, kp, round_to_three_digits(kp * ki), 0.0, limit, step)
        return PidStimulationPlan(units, pid, 0.0, self.goal.relative, base)

    def _score(
        self, candidates: Sequence[PidStimulationPlan], starts: Sequence[StartState], steps: int
    ) -> Floats:
        errors, falls = self._measure(candidates, starts, steps)
        scores: Floats = -errors - _FALL_PENALTY * self.goal.spread * falls
        return scores

    def _measure(
        self, candidates: Sequence[PidStimulationPlan], starts: Sequence[StartState], steps: int
    ) -> tuple[Floats, Floats]:
        """Return mean error and share of falls of each candidate over targets and starts."""
        goal = self.goal
        plans = [replace(one, target=target) for one in candidates for target in goal.targets]
        result = self.prober.measure_plans(plans, starts, steps=steps, measure_from=steps // 3)
        # A roll-out that fell before the measured steps counts as an error of the largest target.
        errors = np.nan_to_num(result.errors, nan=float(np.max(np.abs(goal.targets))))
        shape = (len(candidates), -1)
        return errors.reshape(shape).mean(axis=1), result.falls.reshape(shape).mean(axis=1)


def _rank_by_slope(sweep: UnitEffects, column: int) -> list[tuple[int, float]]:
    """Rank units by how steep and straight their effect curves are, each with the sign of its slope."""
    values = np.array(sweep.values)
    curves = np.nan_to_num(sweep.effects[..., column].mean(axis=2))
    curves = np.where(sweep.falls.any(axis=2), 0.0, curves)
    slope = curves @ values
    order = np.argsort(-np.abs(slope), kind="stable")
    return [(sweep.units[row], float(np.sign(slope[row]))) for row in order if slope[row] != 0]
