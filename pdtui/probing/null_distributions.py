"""What chance alone would show: p-values of paired differences and of units drawn at random."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from pdtui.core.attributes import Floats

_EXACT = 13
"""Largest number of starts for which every flip of signs is tried."""
_FLIPS = 2 ** (_EXACT - 1)
"""Flips of signs that are drawn for more starts."""
_TIE = 1e-9
"""Relative difference below which two sums count as equal, so that rounding does not break ties."""


def sign_flip_p_values(differences: Floats) -> Floats:
    """Return two-sided p-values of the hypothesis that paired differences are as likely to have either sign.

    The mean is compared with the means of all flips of signs over the K starts, so no p-value is below
    ``2 ** (1 - K)``. For more than 13 starts, 4096 flips are drawn.

    Args:
        differences: shape (..., K), such as stimulated minus unstimulated; without NaN.

    Returns:
        The p-values, shape (...,); 1 where all differences are zero.
    """
    starts = differences.shape[-1]
    if starts == 0:
        return np.ones(differences.shape[:-1])
    sums = np.abs(differences @ _sign_flips(starts).T)
    observed = np.abs(differences.sum(axis=-1, keepdims=True))
    return np.asarray((sums >= observed * (1 - _TIE)).mean(axis=-1))


def _sign_flips(starts: int) -> Floats:
    """Return flips of signs, shape (flips, K), the first of which flips none.

    The first start keeps its sign: a two-sided test sees no difference between a flip and its opposite.
    """
    if starts <= _EXACT:
        bits = np.arange(2 ** (starts - 1))[:, None] >> np.arange(starts)
        flips = 1.0 - 2.0 * (bits & 1)
    else:
        flips = np.random.default_rng(0).choice((-1.0, 1.0), size=(_FLIPS, starts))
        flips[0] = 1.0
    return np.asarray(flips, np.float64)


def random_unit_p_value(strength: float, controls: Floats) -> float:
    """Return the share of units drawn at random, itself among them, whose effect is at least as strong."""
    return float((1 + np.sum(controls >= strength * (1 - _TIE))) / (1 + len(controls)))


def smallest_p_value(starts: int, controls: int) -> float:
    """Return the smallest p-value that so many starts and units drawn at random allow."""
    flips = 2.0 ** (1 - starts) if starts <= _EXACT else 1.0 / _FLIPS
    return min(1.0, max(flips, 1.0 / (1 + controls)))


def correct_for_comparisons(p_values: Sequence[float]) -> Floats:
    """Return p-values corrected by Benjamini and Hochberg (1995), shape (M,).

    Of the pairs whose corrected p-value is at most a level, no larger a share than that is false, on average.
    """
    if not len(p_values):
        return np.zeros(0)
    return np.asarray(stats.false_discovery_control(np.array(p_values, np.float64), method="bh"))
