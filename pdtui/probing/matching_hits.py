"""How well matching finds the units that probing finds, and how well probing can be found at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.core.attributes import Floats
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.unit_selection import RANDOM_QUANTILE
from pdtui.spectra.matching import UnitDiscrepancies

TOP_MATCHES = (5, 10)
"""Numbers of first matches whose share of hits is reported."""
_SPLITS = 40
"""Random halves of the starts over which the noise ceiling is averaged."""


@dataclass(frozen=True)
class MatchingAccuracy:
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
        ceiling: how well that strength repeats itself, see `measure_noise_ceiling`.
        disattenuated_matching: `held_out_matching` divided by the root of the ceiling: what it would be if
            probing were free of noise. NaN where probing does not repeat itself.
    """

    first: bool
    best: tuple[float, ...]
    random: float
    correlation: float
    held_out_matching: float
    held_out_probing: float
    ceiling: float
    disattenuated_matching: float


def measure_matching_hits(
    column: int,
    screen: UnitEffects,
    matching: UnitDiscrepancies,
    judged: UnitEffects,
    controls: Sequence[int],
) -> MatchingAccuracy:
    """Compare the ranking by discrepancy with the effects that probing measured.

    The judged effects are from other starts; the controls are those of the judged units drawn at random.
    """
    strengths = screen.robust_strengths(column)
    hits = (strengths > 0) & (strengths > np.quantile(strengths, RANDOM_QUANTILE))
    values = [value for value in screen.values if value in judged.values]
    units = np.array(screen.units)
    screened = screen.mean_strengths(column, values)[np.searchsorted(units, np.array(controls, np.intp))]
    rows = [judged.units.index(unit) for unit in controls]
    held_out = judged.mean_strengths(column, values)[rows]
    probing = rank_correlation(screened, held_out)
    ceiling = measure_noise_ceiling(judged, controls, column, values)
    ranked = matching.ranked_units(column)
    none = float("nan")
    if not ranked.size:
        empty = (none,) * len(TOP_MATCHES)
        return MatchingAccuracy(False, empty, float(hits.mean()), none, none, probing, ceiling, none)
    order = np.searchsorted(units, ranked)
    found = rank_correlation(-matching.discrepancy[column, list(controls)], held_out)
    return MatchingAccuracy(
        first=bool(hits[order[0]]),
        best=tuple(float(hits[order[:count]].mean()) for count in TOP_MATCHES),
        random=float(hits.mean()),
        correlation=rank_correlation(-matching.discrepancy[column, ranked], strengths[order]),
        held_out_matching=found,
        held_out_probing=probing,
        ceiling=ceiling,
        disattenuated_matching=found / np.sqrt(ceiling) if ceiling > 0 else none,
    )


def measure_noise_ceiling(
    effects: UnitEffects, units: Sequence[int], column: int, values: Sequence[float]
) -> float:
    """Return how well the strengths of units repeat themselves: a reliability, at most 1.

    The strengths from one half of the starts are rank-correlated with those from the other, averaged over
    random halves, and corrected to all starts by Spearman and Brown: ``2 r / (1 + r)``. NaN for fewer than
    four starts, or where no strength varies.
    """
    starts = effects.falls.shape[-1]
    if starts < 4:
        return float("nan")
    rows, rng = [effects.units.index(unit) for unit in units], np.random.default_rng(0)
    correlations = []
    for _ in range(_SPLITS):
        order = rng.permutation(starts)
        halves = order[: starts // 2], order[starts // 2 : 2 * (starts // 2)]
        one, other = (effects.mean_strengths(column, values, half)[rows] for half in halves)
        correlations.append(rank_correlation(one, other))
    known = [one for one in correlations if np.isfinite(one)]
    if not known:
        return float("nan")
    half = float(np.mean(known))
    return 2 * half / (1 + half) if half > -1 else float("nan")


def rank_correlation(a: Floats, b: NDArray[np.float64]) -> float:
    """Return Spearman's rank correlation, with ties at their mean rank; NaN if a side does not vary."""
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(stats.spearmanr(a, b).statistic)
