"""What single units do to attributes, measured by roll-outs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats


@dataclass(frozen=True)
class UnitEffects:
    """Effect curves of N units at D values from K starts.

    Attributes:
        units: flat indices.
        values: the outputs v.
        effects: shape (N, D, K, J), as in `PlanEffects`.
        falls: shape (N, D, K).
        unperturbed: shape (K, J).
    """

    units: tuple[int, ...]
    values: tuple[float, ...]
    effects: Floats
    falls: NDArray[np.bool_]
    unperturbed: Floats

    def robust_effects(self, column: int, sign: float) -> Floats:
        """The weakest effect in one direction over all starts, shape (N, D); 0 where the robot fell.

        Negative where at least one start went the other way.
        """
        weakest = np.min(sign * np.nan_to_num(self.effects[..., column]), axis=-1)
        result: Floats = np.where(self.falls.any(axis=-1), np.minimum(weakest, 0.0), weakest)
        return result

    def robust_strengths(self, column: int) -> Floats:
        """How far each unit moves an attribute, whichever way: its best value's robust effect, shape (N,)."""
        both = np.maximum(self.robust_effects(column, 1.0), self.robust_effects(column, -1.0))
        reach: Floats = np.maximum(both.max(axis=1), 0.0)
        return reach

    def mean_strengths(self, column: int, values: Sequence[float]) -> Floats:
        """How far each unit moves an attribute on average over the starts, at its best of some values.

        Unlike `strength` it does not ask for one sign from every start, so it ranks weak units too. A fall
        counts as no effect. Shape (N,).
        """
        doses = [self.values.index(value) for value in values]
        alive = np.where(self.falls, 0.0, np.nan_to_num(self.effects[..., column]))[:, doses]
        furthest: Floats = np.abs(alive.mean(axis=-1)).max(axis=1)
        return furthest

    def safe_magnitude(self, unit: int) -> float:
        """The largest |v| of a unit up to which the robot never fell, 0 if there is none."""
        row = self.units.index(unit)
        alive = 0.0
        for value in sorted({abs(value) for value in self.values}):
            columns = [number for number, v in enumerate(self.values) if abs(v) == value]
            if self.falls[row, columns].any():
                break
            alive = value
        return alive
