"""Decide from probed effects which units are motor primitives, and how well matching alone finds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.probing.effect_probe import UnitEffects
from pdtui.spectra.matching import UnitDiscrepancies
from pdtui.stimulation.stimulation_map import MeasuredEffect

RANDOM_QUANTILE = 0.9
"""A unit exceeds random units if it moves the attribute more than this share of all units does."""
TOP_MATCHES = (5, 10)
"""Numbers of first matches whose share of hits is reported."""


@dataclass(frozen=True)
class PrimitiveConfirmation:
    """What probing says about one unit and one attribute.

    Attributes:
        unit: flat index.
        value: output v with the strongest effect, among the values at which all units were screened.
        measured: effect at that value with its 95 % interval over the starts.
        one_sign: whether the effect had the same sign from every start, without a fall.
        exceeds_random: whether it exceeds the effect of `RANDOM_QUANTILE` of all units at the same |v|.
        both_ways: whether +v and −v move the attribute in opposite directions, each from every start.
        safe_magnitude: largest |v| up to which the robot never fell.
    """

    unit: int
    value: float
    measured: MeasuredEffect
    one_sign: bool
    exceeds_random: bool
    both_ways: bool
    safe_magnitude: float

    @property
    def confirmed(self) -> bool:
        """Whether the effect has one sign, exceeds random units and has an interval without zero."""
        return self.one_sign and self.exceeds_random and self.measured.low * self.measured.high > 0


@dataclass(frozen=True)
class MatchingHitRate:
    """How well matching alone finds the units that move an attribute.

    A hit is a unit whose screened strength is in the highest tenth and not zero. Correlations are NaN where
    either side does not vary.

    Attributes:
        first: whether the first match is a hit.
        best: share of hits among the first 5 and the first 10 matches (`TOP_MATCHES`).
        random: share of hits among all units.
        correlation: rank correlation of small discrepancy with strength over all units.
        held_out_matching: the same over the control units, with their strength from starts that screening did
            not see.
        held_out_probing: rank correlation of the screened strength of the control units with that strength.
    """

    first: bool
    best: tuple[float, ...]
    random: float
    correlation: float
    held_out_matching: float
    held_out_probing: float


def select_units_to_refine(
    screen: UnitEffects, matching: UnitDiscrepancies, columns: Sequence[int], keep: int
) -> tuple[int, ...]:
    """Choose the first match of each attribute, and the `keep` strongest probed units in each direction."""
    chosen: set[int] = set()
    for column in columns:
        chosen.update(matching.ranked_units(column)[:1].tolist())
        for sign in (1.0, -1.0):
            strengths = screen.robust_effects(column, sign).max(axis=1)
            order = np.argsort(-strengths, kind="stable")[:keep]
            chosen.update(screen.units[row] for row in order if strengths[row] > 0)
    return tuple(sorted(chosen))


def sample_control_units(screen: UnitEffects, count: int, seed: int) -> tuple[int, ...]:
    """Draw units at random, whatever they do: a ranking has to beat them."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(screen.units, size=min(count, len(screen.units)), replace=False)
    return tuple(sorted(chosen.tolist()))


def confirm_unit(
    unit: int, column: int, screen: UnitEffects, refined: UnitEffects, seed: int
) -> PrimitiveConfirmation:
    """Judge one unit by its refined effects.

    It is judged at the values at which all units were screened, by its effects from other starts.
    """
    row = refined.units.index(unit)
    shared = [dose for dose, value in enumerate(refined.values) if value in screen.values]
    up, down = (refined.robust_effects(column, sign)[row] for sign in (1.0, -1.0))
    robust = np.maximum(up, down)
    dose = shared[int(np.argmax(robust[shared]))]
    samples = refined.effects[row, dose, :, column]
    known = samples[np.isfinite(samples)]
    effect = float(known.mean()) if known.size else float("nan")
    value = refined.values[dose]
    low, high = bootstrap_interval(samples, seed)
    return PrimitiveConfirmation(
        unit=unit,
        value=value,
        measured=MeasuredEffect(effect, low, high),
        one_sign=bool(robust[dose] > 0),
        exceeds_random=exceeds_random_units(effect, value, column, screen),
        both_ways=_moves_both_ways(refined.values, up > 0, down > 0),
        safe_magnitude=refined.safe_magnitude(unit),
    )


def rank_probed_units(
    column: int, screen: UnitEffects, refined: UnitEffects, seed: int, count: int = 3
) -> list[PrimitiveConfirmation]:
    """Return the `count` best of the refined units that move an attribute most, confirmed ones first."""
    order = np.argsort(-refined.robust_strengths(column), kind="stable")[: 4 * count]
    judged = [confirm_unit(refined.units[row], column, screen, refined, seed) for row in order]
    return sorted(judged, key=lambda one: not one.confirmed)[:count]


def measure_matching_hits(
    column: int,
    screen: UnitEffects,
    matching: UnitDiscrepancies,
    refined: UnitEffects,
    controls: Sequence[int],
) -> MatchingHitRate:
    """Compare the ranking by discrepancy with the effects that probing measured.

    The refined effects are from other starts; the controls are those of the refined units drawn at random.
    """
    strengths = screen.robust_strengths(column)
    hits = (strengths > 0) & (strengths > np.quantile(strengths, RANDOM_QUANTILE))
    values = [value for value in screen.values if value in refined.values]
    units = np.array(screen.units)
    screened = screen.mean_strengths(column, values)[np.searchsorted(units, np.array(controls, np.intp))]
    rows = [refined.units.index(unit) for unit in controls]
    held_out = refined.mean_strengths(column, values)[rows]
    probing = rank_correlation(screened, held_out)
    ranked = matching.ranked_units(column)
    if not ranked.size:
        none = float("nan")
        return MatchingHitRate(False, (none,) * len(TOP_MATCHES), float(hits.mean()), none, none, probing)
    order = np.searchsorted(units, ranked)
    return MatchingHitRate(
        first=bool(hits[order[0]]),
        best=tuple(float(hits[order[:count]].mean()) for count in TOP_MATCHES),
        random=float(hits.mean()),
        correlation=rank_correlation(-matching.discrepancy[column, ranked], strengths[order]),
        held_out_matching=rank_correlation(-matching.discrepancy[column, list(controls)], held_out),
        held_out_probing=probing,
    )


def rank_correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return Spearman's rank correlation, with ties at their mean rank; NaN if a side does not vary."""
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(stats.spearmanr(a, b).statistic)


def exceeds_random_units(effect: float, value: float, column: int, screen: UnitEffects) -> bool:
    """Return whether an effect exceeds that of `RANDOM_QUANTILE` of all units at the nearest screened |v|."""
    magnitude = min((abs(v) for v in screen.values), key=lambda size: abs(size - abs(value)))
    doses = [dose for dose, v in enumerate(screen.values) if abs(v) == magnitude]
    # A fall before the measured steps leaves NaN, which counts as no effect.
    sizes = np.abs(np.nan_to_num(screen.effects[:, doses, :, column]).mean(axis=-1))
    return bool(abs(effect) > np.quantile(sizes, RANDOM_QUANTILE))


def _moves_both_ways(values: Sequence[float], up: NDArray[np.bool_], down: NDArray[np.bool_]) -> bool:
    for dose, value in enumerate(values):
        if value > 0 and -value in values:
            mirror = values.index(-value)
            if (up[dose] and down[mirror]) or (down[dose] and up[mirror]):
                return True
    return False
