"""Search for a unit through which a PID controller holds an attribute at a target."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.dissection.monitor import Start
from pdtui.dissection.probe import Prober, Sweep
from pdtui.dissection.rollout import Hold
from pdtui.policies.units import NO_STIMULATION, Stimulation
from pdtui.robots.types import Floats
from pdtui.stimulation.maps import Pid

_FALL = 1.0


@dataclass(frozen=True)
class Held:
    """The best controller for an attribute.

    Attributes:
        weights: units, and how much of the controller's output each is overwritten with.
        pid: gains.
        error: mean distance from the targets over the held-out starts, in the attribute's unit.
        uncontrolled: the same distance without stimulation.
        falls: share of the held-out roll-outs on which the robot fell.
        targets: those that it was measured at.
        relative: whether they count from the value at the start.
    """

    weights: Stimulation
    pid: Pid
    error: float
    uncontrolled: float
    falls: float
    targets: tuple[float, ...]
    relative: bool

    @property
    def holds(self) -> bool:
        """Whether it more than halves the distance and seldom falls."""
        return self.error < 0.5 * self.uncontrolled and self.falls <= 0.1


@dataclass(frozen=True)
class HoldSizes:
    """How much a search does: units tried alone, then finalists; control steps of either stage."""

    units: int = 10
    finalists: int = 8
    steps: int = 150
    final_steps: int = 300


@dataclass(frozen=True)
class Aimed:
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


class HoldSearch:
    """Tries controllers on the units whose effect grows most evenly with v.

    Args:
        prober: measures.
        aimed: what is to be held, and where.
        sizes: how much to do.
    """

    def __init__(self, prober: Prober, aimed: Aimed, sizes: HoldSizes) -> None:
        self._prober, self._aimed, self._sizes = prober, aimed, sizes

    def run(
        self,
        sweep: Sweep,
        column: int,
        search: Sequence[Start],
        held_out: Sequence[Start],
        deadline: Callable[[], bool],
    ) -> Held | None:
        """The best controller, or None where no unit moves the attribute or the time is up.

        Args:
            sweep: effect curves.
            column: of the attribute.
            search: starts of the search.
            held_out: starts that the search does not see; the first half of them decides between the
                finalists, the other half gives the figures.
            deadline: says when time is up.
        """
        units = _steerers(sweep, column)[: self._sizes.units]
        if not units or deadline():
            return None
        spread, sizes = self._aimed.spread, self._sizes
        gains = (0.0,) if self._aimed.relative else (0.5, 2.0)
        candidates = [
            (Stimulation((unit,), (weight,)), self._pid(limit, kp / spread, ki))
            for unit, weight in units
            for limit in (2.0, 4.0, 8.0)
            for kp in (limit, 3 * limit)
            for ki in gains
        ]
        cost = self._cost(candidates, search, sizes.steps)
        finalists = [candidates[index] for index in np.argsort(cost, kind="stable")[: sizes.finalists]]
        half = len(held_out) // 2
        cost = self._cost(finalists, held_out[:half], sizes.final_steps)
        weights, pid = finalists[int(np.argmin(cost))]
        errors, falls = self._measure(
            [(weights, pid), (NO_STIMULATION, pid)], held_out[half:], sizes.final_steps
        )
        aimed = self._aimed
        return Held(
            weights, pid, float(errors[0]), float(errors[1]), float(falls[0]), aimed.targets, aimed.relative
        )

    def _pid(self, limit: float, kp: float, ki: float) -> Pid:
        kp = float(f"{kp:.3g}")
        step = float(f"{self._aimed.spread / 4:.1g}")
        return Pid(self._aimed.attribute, kp, float(f"{kp * ki:.3g}"), 0.0, limit, step)

    def _cost(
        self, candidates: Sequence[tuple[Stimulation, Pid]], starts: Sequence[Start], steps: int
    ) -> Floats:
        errors, falls = self._measure(candidates, starts, steps)
        cost: Floats = errors + _FALL * self._aimed.spread * falls
        return cost

    def _measure(
        self, candidates: Sequence[tuple[Stimulation, Pid]], starts: Sequence[Start], steps: int
    ) -> tuple[Floats, Floats]:
        """Mean error and share of falls of each candidate over targets and starts."""
        aimed = self._aimed
        plans = [
            Hold(weights, pid, target, aimed.relative)
            for weights, pid in candidates
            for target in aimed.targets
        ]
        result = self._prober.probe(plans, starts, steps=steps, measure_from=steps // 3)
        # Whoever fell before the measured steps held nothing: it counts as the largest target.
        errors = np.nan_to_num(result.errors, nan=float(np.max(np.abs(aimed.targets))))
        shape = (len(candidates), -1)
        return errors.reshape(shape).mean(axis=1), result.falls.reshape(shape).mean(axis=1)


def _steerers(sweep: Sweep, column: int) -> list[tuple[int, float]]:
    """Units with the sign of their slope, those with the steepest and straightest curves first."""
    values = np.array(sweep.values)
    curves = np.nan_to_num(sweep.effects[..., column].mean(axis=2))
    curves = np.where(sweep.falls.any(axis=2), 0.0, curves)
    slope = curves @ values
    order = np.argsort(-np.abs(slope), kind="stable")
    return [(sweep.units[row], float(np.sign(slope[row]))) for row in order if slope[row] != 0]
