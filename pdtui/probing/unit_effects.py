"""Effects of single units on attributes, measured by roll-outs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats


@dataclass(frozen=True)
class UnitEffects:
    """Effects of N units, overwritten with D values from K starts, on J attributes.

    Attributes:
        units: flat indices of the units.
        values: the values v with which each unit is overwritten.
        effects: change of each attribute against the unperturbed roll-out, shape (N, D, K, J), as in
            `PlanEffects`.
        falls: whether the robot fell, shape (N, D, K).
        unperturbed: means of the attributes without stimulation, shape (K, J).
    """

    units: tuple[int, ...]
    values: tuple[float, ...]
    effects: Floats
    falls: NDArray[np.bool_]
    unperturbed: Floats

    def robust_effects(self, column: int, sign: float) -> Floats:
        """Return the weakest effect over all starts in the direction of `sign`, shape (N, D).

        It is negative where the effect from a start has the other sign, and at most 0 where the robot fell.
        """
        weakest = np.min(sign * np.nan_to_num(self.effects[..., column]), axis=-1)
        result: Floats = np.where(self.falls.any(axis=-1), np.minimum(weakest, 0.0), weakest)
        return result

    def robust_strengths(self, column: int) -> Floats:
        """Return the largest robust effect of each unit over its values and both directions, shape (N,)."""
        both = np.maximum(self.robust_effects(column, 1.0), self.robust_effects(column, -1.0))
        strengths: Floats = np.maximum(both.max(axis=1), 0.0)
        return strengths

    def mean_strengths(self, column: int, values: Sequence[float]) -> Floats:
        """Return the largest mean effect of each unit over the starts, in size, at some values, shape (N,).

        Unlike `robust_strengths` it does not require one sign from every start, so it ranks weak units too.
        A fall counts as no effect.
        """
        doses = [self.values.index(value) for value in values]
        effects = np.where(self.falls, 0.0, np.nan_to_num(self.effects[..., column]))[:, doses]
        strengths: Floats = np.abs(effects.mean(axis=-1)).max(axis=1)
        return strengths

    def safe_magnitude(self, unit: int) -> float:
        """Return the largest |v| of a unit up to which the robot never fell; 0 if there is none."""
        row = self.units.index(unit)
        safe = 0.0
        for value in sorted({abs(value) for value in self.values}):
            columns = [number for number, v in enumerate(self.values) if abs(v) == value]
            if self.falls[row, columns].any():
                break
            safe = value
        return safe
