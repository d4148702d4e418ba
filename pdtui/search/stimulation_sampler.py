"""Stimulations worth trying: drawn at random, changed a little, or crossed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation

_SPREAD = 0.4
_FLIP = 0.08


@dataclass(frozen=True)
class OutputBounds:
    """What a candidate may be.

    Attributes:
        smallest: least |v| that is drawn.
        drawn: largest |v| that is drawn.
        largest: |v| at most, however often it was scaled up.
    """

    smallest: float = 1.0
    drawn: float = 15.0
    largest: float = 20.0


class StimulationSampler:
    """Seeded source of stimulations.

    Args:
        weights: how often to draw each unit, shape (U,); not negative, not all zero.
        bounds: of the outputs v.
        seed: of every random choice, or a generator that other choices share.
    """

    def __init__(self, weights: Floats, bounds: OutputBounds, seed: int | np.random.Generator) -> None:
        self._shares = weights / weights.sum()
        self._bounds = bounds
        self.rng = np.random.default_rng(seed)

    def draw(self, units: int) -> Stimulation:
        """Different units, as many as asked, with outputs spread evenly over magnitudes and signs."""
        rng, bounds = self.rng, self._bounds
        chosen = rng.choice(len(self._shares), size=units, replace=False, p=self._shares)
        sizes = np.exp(rng.uniform(np.log(bounds.smallest), np.log(bounds.drawn), units))
        return self._tidy(dict(zip(chosen.tolist(), sizes * rng.choice([-1.0, 1.0], units), strict=True)))

    def mutate(self, parent: Stimulation, most: int) -> Stimulation:
        """One change: scale some outputs, swap or add or drop units, or scale all; at most `most` units.

        Of many units an eighth changes at once: one alone would hardly show.
        """
        rng = self.rng
        values = _as_dict(parent)
        some = max(1, len(values) // 8)
        kind = rng.random()
        if kind < 0.4 or (kind < 0.6 and len(values) >= most):
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
        return self._tidy(self._fewer(values, most))

    def cross_over(self, one: Stimulation, other: Stimulation, most: int) -> Stimulation:
        """Units of both, thinned to at most `most`."""
        return self._tidy(self._fewer(_as_dict(one) | _as_dict(other), most))

    def choose_parent(self, ranked: Sequence[Stimulation]) -> Stimulation:
        """One of a list, the earlier ones more often."""
        return ranked[int(self.rng.random() ** 2 * len(ranked))]

    def _fewer(self, values: dict[int, float], most: int) -> dict[int, float]:
        for unit in self._pick(values, max(0, len(values) - most)):
            del values[unit]
        return values

    def _pick(self, values: Mapping[int, float], count: int) -> list[int]:
        chosen: list[int] = self.rng.choice(list(values), size=count, replace=False).tolist()
        return chosen

    def _tidy(self, values: Mapping[int, float]) -> Stimulation:
        """Units in order, values of three digits: what a map says is then exactly what was measured."""
        limit = self._bounds.largest
        return Stimulation.of(
            {u: round_to_three_digits(np.clip(v, -limit, limit)) for u, v in sorted(values.items())}
        )


def round_to_three_digits(value: float) -> float:
    """The value that a map's text says, which is then exactly what is measured."""
    return float(f"{value:.3g}")


def _as_dict(stimulation: Stimulation) -> dict[int, float]:
    return dict(zip(stimulation.units, stimulation.values, strict=True))
