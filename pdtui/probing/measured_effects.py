"""Measured effects of stimulations on attributes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats


@dataclass(frozen=True)
class PlanEffects:
    """Effects of S plans from each of K starts on J attributes.

    Attributes:
        effects: change of each attribute against the unperturbed roll-out from the same start, in its unit,
            shape (S, K, J): a difference of means over the measured steps; for an angle, of its mean change
            since the start. NaN where the episode ended before the measured steps.
        means: the means with stimulation, shape (S, K, J).
        unperturbed: the means without stimulation, shape (K, J).
        falls: whether the roll-out failed, as `is_failure` says, shape (S, K). One in which the robot arrives
            is measured up to its end.
        errors: mean distance from the target for plans with a controller, else NaN, shape (S, K).
        unperturbed_falls: whether the robot fell without stimulation, shape (K,).
    """

    effects: Floats
    means: Floats
    unperturbed: Floats
    falls: NDArray[np.bool_]
    errors: Floats
    unperturbed_falls: NDArray[np.bool_]

    def counted_effects(self) -> Floats:
        """Return the effects, shape (S, K, J). A fall with or without stimulation counts as none."""
        return _count_falls_as_none(self.effects, self.falls | self.unperturbed_falls)


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
        unperturbed_falls: whether the robot fell without stimulation, shape (K,).
    """

    units: tuple[int, ...]
    values: tuple[float, ...]
    effects: Floats
    falls: NDArray[np.bool_]
    unperturbed: Floats
    unperturbed_falls: NDArray[np.bool_]

    def counted_effects(self) -> Floats:
        """Return the effects, shape (N, D, K, J). A fall with or without stimulation counts as none."""
        return _count_falls_as_none(self.effects, self.falls | self.unperturbed_falls)

    def robust_effects(self, column: int, sign: float) -> Floats:
        """Return the weakest effect over all starts in the direction of `sign`, shape (N, D).

        It is negative where the effect from a start has the other sign, and at most 0 where the robot fell.
        Starts from which it falls by itself, or has arrived before the measured steps, say nothing, and are
        left out.
        """
        stays_up = ~self.unperturbed_falls & np.isfinite(self.unperturbed[:, column])
        if not stays_up.any():
            return np.zeros(self.falls.shape[:2])
        weakest = np.min(sign * np.nan_to_num(self.effects[:, :, stays_up, column]), axis=-1)
        fell = self.falls[..., stays_up].any(axis=-1)
        return np.asarray(np.where(fell, np.minimum(weakest, 0.0), weakest))

    def robust_strengths(self, column: int) -> Floats:
        """Return the largest robust effect of each unit over its values and both directions, shape (N,)."""
        both = np.maximum(self.robust_effects(column, 1.0), self.robust_effects(column, -1.0))
        return np.asarray(np.maximum(both.max(axis=1), 0.0))

    def mean_strengths(
        self, column: int, values: Sequence[float], starts: Sequence[int] | NDArray[np.intp] | None = None
    ) -> Floats:
        """Return the largest mean effect of each unit over the starts, in size, at some values, shape (N,).

        Unlike `robust_strengths` it does not require one sign from every start, so it ranks weak units too.
        A fall counts as no effect. Without `starts`, all are used.
        """
        doses = [self.values.index(value) for value in values]
        fell = (self.falls | self.unperturbed_falls)[:, doses]
        effects = _count_falls_as_none(self.effects[:, doses][..., [column]], fell)[..., 0]
        if starts is not None:
            effects = effects[..., starts]
        return np.asarray(np.abs(effects.mean(axis=-1)).max(axis=1))

    def safe_magnitude(self, unit: int) -> float:
        """Return the largest |v| of a unit up to which the robot never fell; 0 if there is none.

        Starts from which it falls by itself are left out.
        """
        row = self.units.index(unit)
        stimulated = (self.falls[row] & ~self.unperturbed_falls).any(axis=-1)
        falls = zip(self.values, stimulated, strict=True)
        lowest_fall = min((abs(value) for value, fell in falls if fell), default=np.inf)
        return max((abs(value) for value in self.values if abs(value) < lowest_fall), default=0.0)


@dataclass(frozen=True)
class SingleUnitEffects:
    """Effects of single units, each held at outputs of its own.

    Attributes:
        rows: row of each unit and output among the plans.
        plans: the effects of all of them.
    """

    rows: Mapping[tuple[int, float], int]
    plans: PlanEffects

    def effects_of(self, unit: int, value: float) -> Floats:
        """Return the effects of a unit that is held at an output, shape (K, J). A fall counts as none."""
        return np.asarray(self._counted[self.rows[unit, value]])

    @cached_property
    def _counted(self) -> Floats:
        return self.plans.counted_effects()

    def falls_of(self, unit: int, value: float) -> int:
        """Return from how many starts the robot fell."""
        return int(self.plans.falls[self.rows[unit, value]].sum())

    def from_starts(self, starts: slice) -> SingleUnitEffects:
        """Return the effects from some of the starts."""
        plans = self.plans
        fewer = PlanEffects(
            plans.effects[:, starts],
            plans.means[:, starts],
            plans.unperturbed[starts],
            plans.falls[:, starts],
            plans.errors[:, starts],
            plans.unperturbed_falls[starts],
        )
        return replace(self, plans=fewer)

    def select(self, units: Sequence[int], values: Sequence[float]) -> UnitEffects:
        """Return the effects of some units at common outputs."""
        rows = np.array([[self.rows[unit, value] for value in values] for unit in units], np.intp)
        plans = self.plans
        return UnitEffects(
            tuple(units),
            tuple(values),
            plans.effects[rows],
            plans.falls[rows],
            plans.unperturbed,
            plans.unperturbed_falls,
        )


def _count_falls_as_none(effects: Floats, fell: NDArray[np.bool_]) -> Floats:
    return np.asarray(np.where(fell[..., None], 0.0, np.nan_to_num(effects)))
