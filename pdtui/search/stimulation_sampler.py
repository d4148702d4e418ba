"""A source of candidate stimulations: drawn at random, mutated, or crossed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation

Plan = TypeVar("Plan")
CROSSED = 0.25
"""Share of children that cross two parents instead of changing one."""
_SPREAD = 0.4
"""Standard deviation of the logarithm of a factor on an output."""
_FLIP = 0.08
"""Probability that such a factor also changes the sign."""


@dataclass(frozen=True)
class UnitOutputBounds:
    """Limits of the outputs v.

    Attributes:
        smallest: smallest |v| that is drawn.
        drawn: largest |v| that is drawn.
        largest: largest |v| that mutation can reach.
    """

    smallest: float = 1.0
    drawn: float = 15.0
    largest: float = 20.0


class StimulationSampler:
    """Seeded source of stimulations.

    Args:
        weights: relative frequency of each unit, shape (U,); not negative, not all zero.
        bounds: limits of the outputs.
        seed: seed of every random choice, or a generator shared with other code.
    """

    def __init__(self, weights: Floats, bounds: UnitOutputBounds, seed: int | np.random.Generator) -> None:
        self._shares = weights / weights.sum()
        self._bounds = bounds
        self.rng = np.random.default_rng(seed)

    def draw(self, units: int) -> Stimulation:
        """Draw so many different units; the logarithms of their outputs are uniform, signs are random."""
        rng, bounds = self.rng, self._bounds
        chosen = rng.choice(len(self._shares), size=units, replace=False, p=self._shares)
        sizes = np.exp(rng.uniform(np.log(bounds.smallest), np.log(bounds.drawn), units))
        return self._as_stimulation(
            dict(zip(chosen.tolist(), sizes * rng.choice([-1.0, 1.0], units), strict=True))
        )

    def vary(self, elite: Sequence[Stimulation], max_units: int) -> Stimulation:
        """Mutate one of the elite, or cross two; at most `max_units` units."""
        parent = self.choose_parent(elite)
        if self.rng.random() < CROSSED:
            return self.cross_over(parent, self.choose_parent(elite), max_units)
        return self.mutate(parent, max_units)

    def mutate(self, parent: Stimulation, max_units: int) -> Stimulation:
        """Scale some outputs, swap, add or drop units, or scale all outputs; at most `max_units` units.

        Of many units an eighth changes at once, since a single one would hardly show.
        """
        rng, max_units = self.rng, min(max_units, len(self._shares))
        values = _as_dict(parent)
        some = max(1, len(values) // 8)
        kind = rng.random()
        if kind < 0.4 or (kind < 0.6 and len(values) >= max_units):
            factor = float(np.exp(rng.normal(0.0, _SPREAD))) * (-1.0 if rng.random() < _FLIP else 1.0)
            for unit in self._pick(values, some):
                values[unit] *= factor
        elif kind < 0.6:
            values |= _as_dict(self.draw(1))
        elif kind < 0.75:
            for unit in self._pick(values, some):
                del values[unit]
            values |= _as_dict(self.draw(1))
        elif kind < 0.87 and len(values) > 1:
            for unit in self._pick(values, some):
                del values[unit]
        else:
            factors = np.exp(rng.normal(0.0, _SPREAD / 2, len(values)))
            values = {unit: v * float(f) for (unit, v), f in zip(values.items(), factors, strict=True)}
        return self._as_stimulation(self._drop_units(values, max_units))

    def cross_over(self, one: Stimulation, other: Stimulation, max_units: int) -> Stimulation:
        """Combine the units of two parents, dropping some at random above `max_units`."""
        return self._as_stimulation(self._drop_units(_as_dict(one) | _as_dict(other), max_units))

    def choose_parent(self, ranked: Sequence[Plan]) -> Plan:
        """Return one of the plans, the earlier ones more often."""
        return ranked[int(self.rng.random() ** 2 * len(ranked))]

    def _drop_units(self, values: dict[int, float], max_units: int) -> dict[int, float]:
        for unit in self._pick(values, max(0, len(values) - max_units)):
            del values[unit]
        return values

    def _pick(self, values: Mapping[int, float], count: int) -> list[int]:
        chosen: list[int] = self.rng.choice(list(values), size=count, replace=False).tolist()
        return chosen

    def _as_stimulation(self, values: Mapping[int, float]) -> Stimulation:
        """Sort the units and round the outputs, so that a map says exactly what was measured."""
        limit = self._bounds.largest
        return Stimulation.of(
            {u: round_to_three_digits(np.clip(v, -limit, limit)) for u, v in sorted(values.items())}
        )


def round_outputs(values: Floats) -> tuple[float, ...]:
    """Return outputs with three significant digits, as a map's text gives them."""
    return tuple(round_to_three_digits(value) for value in values.tolist())


def round_to_three_digits(value: float) -> float:
    """Return a value with three significant digits, as a map's text gives it."""
    return float(f"{value:.3g}")


def _as_dict(stimulation: Stimulation) -> dict[int, float]:
    return dict(zip(stimulation.units, stimulation.values, strict=True))
