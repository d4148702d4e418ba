"""Is a unit a motor primitive? Screening ranks all, refining confirms, matching is held against both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.core.attributes import Floats
from pdtui.probing.effect_probe import EffectCurves, bootstrap_interval
from pdtui.spectra.matching import Discrepancies
from pdtui.stimulation.stimulation_map import MeasuredEffect

RARE = 0.9
"""A unit exceeds units drawn at random when it moves the attribute more than this share of all units does."""
BEST = (5, 10)


@dataclass(frozen=True)
class PrimitiveConfirmation:
    """What probing says about one unit and one attribute.

    Attributes:
        unit: flat index.
        value: output v at which the effect is strongest, of the values that all units were screened at.
        measured: effect there with its 95 % interval over the starts.
        one_sign: whether the effect had that sign from every start, without a fall.
        exceeds: whether it is larger than that of `RARE` of all units at the same |v|.
        both_ways: whether +v and −v move the attribute in opposite directions, each from every start.
        survived: largest |v| up to which the robot never fell.
    """

    unit: int
    value: float
    measured: MeasuredEffect
    one_sign: bool
    exceeds: bool
    both_ways: bool
    survived: float

    @property
    def confirmed(self) -> bool:
        """One sign, more than units drawn at random, and an interval without zero."""
        return self.one_sign and self.exceeds and self.measured.low * self.measured.high > 0


@dataclass(frozen=True)
class MatchingHitRate:
    """How well matching alone finds what moves an attribute.

    A hit is a unit whose screened strength is among the highest tenth and not zero.

    Attributes:
        first: whether the first match is one.
        best: share of the first 5 and of the first 10 matches that are (`BEST`).
        random: share of all units that are.
        correlation: rank correlation of small discrepancy with strength over all units.
        held_out_matching: the same against the strength of units drawn at random, from starts that
            screening did not see.
        held_out_probing: rank correlation of screened strength with that strength.

    Correlations are NaN where either side does not vary.
    """

    first: bool
    best: tuple[float, ...]
    random: float
    correlation: float
    held_out_matching: float
    held_out_probing: float


def select_units(
    screen: EffectCurves, match: Discrepancies, columns: Sequence[int], keep: int
) -> tuple[int, ...]:
    """Units worth refining: of each attribute the first match, and the best probed in each direction."""
    chosen: set[int] = set()
    for column in columns:
        chosen.update(match.ranked(column)[:1].tolist())
        for sign in (1.0, -1.0):
            reach = screen.robust(column, sign).max(axis=1)
            order = np.argsort(-reach, kind="stable")[:keep]
            chosen.update(screen.units[row] for row in order if reach[row] > 0)
    return tuple(sorted(chosen))


def draw_controls(screen: EffectCurves, count: int, seed: int) -> tuple[int, ...]:
    """Units drawn at random, whatever they do: what a ranking has to beat."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(screen.units, size=min(count, len(screen.units)), replace=False)
    return tuple(sorted(chosen.tolist()))


def confirm_unit(
    unit: int, column: int, screen: EffectCurves, refined: EffectCurves, seed: int
) -> PrimitiveConfirmation:
    """Judge one unit by its refined effect curve.

    Args:
        unit: flat index, refined.
        column: of the attribute.
        screen: every unit, at a few values.
        refined: some units, at those values and more, from other starts.
        seed: of the bootstrap.
    """
    row = refined.units.index(unit)
    shared = [dose for dose, value in enumerate(refined.values) if value in screen.values]
    robust = np.maximum(refined.robust(column, 1.0), refined.robust(column, -1.0))[row]
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
        exceeds=exceeds_random(effect, value, column, screen),
        both_ways=_both_ways(refined, row, column),
        survived=refined.survived(unit),
    )


def best_probed(
    column: int, screen: EffectCurves, refined: EffectCurves, seed: int, count: int = 3
) -> list[PrimitiveConfirmation]:
    """The refined units that move an attribute most, confirmed ones first."""
    order = np.argsort(-refined.strength(column), kind="stable")[: 4 * count]
    judged = [confirm_unit(refined.units[row], column, screen, refined, seed) for row in order]
    return sorted(judged, key=lambda one: not one.confirmed)[:count]


def matching_hit_rate(
    column: int, screen: EffectCurves, match: Discrepancies, refined: EffectCurves, controls: Sequence[int]
) -> MatchingHitRate:
    """Hold the ranking by discrepancy against what probing measured.

    Args:
        column: of the attribute.
        screen: every unit.
        match: the ranking.
        refined: some units again, from other starts.
        controls: those of them that were drawn at random.
    """
    strength = screen.strength(column)
    hits = (strength > 0) & (strength > np.quantile(strength, RARE))
    doses = [value for value in screen.values if value in refined.values]
    rows = [refined.units.index(unit) for unit in controls]
    seen = screen.reach(column, doses)[np.searchsorted(np.array(screen.units), np.array(controls, np.intp))]
    held_out = refined.reach(column, doses)[rows]
    probing = rank_correlation(seen, held_out)
    ranked = match.ranked(column)
    if not ranked.size:
        none = float("nan")
        return MatchingHitRate(False, (none,) * len(BEST), float(hits.mean()), none, none, probing)
    order = np.searchsorted(np.array(screen.units), ranked)
    return MatchingHitRate(
        first=bool(hits[order[0]]),
        best=tuple(float(hits[order[:count]].mean()) for count in BEST),
        random=float(hits.mean()),
        correlation=rank_correlation(-match.discrepancy[column, ranked], strength[order]),
        held_out_matching=rank_correlation(-match.discrepancy[column, list(controls)], held_out),
        held_out_probing=probing,
    )


def rank_correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Spearman's rank correlation, ties at their mean rank; NaN where one side does not vary."""
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(stats.spearmanr(a, b).statistic)


def exceeds_random(effect: float, value: float, column: int, screen: EffectCurves) -> bool:
    """Whether an effect is larger than that of `RARE` of all units at the same |v|, or the nearest one."""
    screened = min((abs(v) for v in screen.values), key=lambda size: abs(size - abs(value)))
    return bool(abs(effect) > np.quantile(_sizes(screen, column, screened), RARE))


def _sizes(screen: EffectCurves, column: int, size: float) -> Floats:
    """How far each unit and sign of v moves the attribute, whether steadily or not, at one |v|."""
    doses = [dose for dose, value in enumerate(screen.values) if abs(value) == size]
    # Falls before the measured steps leave no number behind: no effect of a living robot.
    sizes: Floats = np.abs(np.nan_to_num(screen.effects[:, doses, :, column]).mean(axis=-1)).reshape(-1)
    return sizes


def _both_ways(refined: EffectCurves, row: int, column: int) -> bool:
    up, down = refined.robust(column, 1.0)[row] > 0, refined.robust(column, -1.0)[row] > 0
    for dose, value in enumerate(refined.values):
        if value > 0 and -value in refined.values:
            mirror = refined.values.index(-value)
            if (up[dose] and down[mirror]) or (down[dose] and up[mirror]):
                return True
    return False
