"""Statistics of paired differences and of shares: intervals, tests, and their correction over a table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import confidence_interval

RESAMPLES = 9_999
"""Resamples of an interval and random flips of a test: p-values are multiples of 1 / 10 000."""
FEWEST_FOR_BOOTSTRAP = 8
"""Below this number of values, too many resamples consist of one value, and Student's t is used instead."""
_EXACT_UP_TO = 13
"""Largest number of differences of which all sign flips are counted: 2 ** 13 is less than `RESAMPLES`."""


def studentized_interval(values: Floats, *, level: float = 0.95, seed: int = 0) -> tuple[float, float]:
    """Return the studentized bootstrap interval of a mean (Efron and Tibshirani, 1993, section 12.5).

    Unlike a percentile interval it is wide enough for 20 values, and it can contain 0 although all values
    have one sign.

    Args:
        values: One value per start, shape (n,). Of fewer than `FEWEST_FOR_BOOTSTRAP`, or of equal values, the
            interval is Student's; it is infinite for fewer than 2.
        level: Coverage of the interval.
        seed: Seed of the resampling.
    """
    count = len(values)
    if count < FEWEST_FOR_BOOTSTRAP or np.ptp(values) == 0.0:
        return confidence_interval(values)
    drawn = values[np.random.default_rng(seed).integers(count, size=(RESAMPLES, count))]
    spread = drawn.std(axis=1, ddof=1)
    usable = spread > 1e-12 * np.abs(values).max()
    ratios = (drawn.mean(axis=1)[usable] - values.mean()) / spread[usable]
    low, high = np.quantile(ratios, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    mean, own = float(values.mean()), float(values.std(ddof=1))
    return mean - float(high) * own, mean - float(low) * own


def share_interval(successes: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of a share (Clopper and Pearson, 1934); it is 0 to 1 for no trials."""
    if count == 0:
        return 0.0, 1.0
    found = stats.binomtest(successes, count).proportion_ci(level, method="exact")
    return float(found.low), float(found.high)


def sign_flip_p_value(differences: Floats, seed: int = 0) -> float:
    """Return the two-sided p-value of a mean of paired differences, by flipping their signs at random.

    Under the hypothesis of no effect, each difference was as likely with the other sign. Of differences of
    successes (−1, 0, 1) it is the exact McNemar test.

    Args:
        differences: One difference per start, shape (n,).
        seed: Seed of the flips, where they are too many to count all.

    Returns:
        The share of flips whose mean is at least as far from 0, at least 2 / 2 ** n and 1 / 10 000; 1 for no
        differences.
    """
    count = len(differences)
    if count == 0:
        return 1.0
    exact = count <= _EXACT_UP_TO
    if exact:
        bits = np.arange(2**count)[:, None] >> np.arange(count)
        signs = 1.0 - 2.0 * (bits & 1)
    else:
        signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(RESAMPLES, count))
    own = abs(float(differences.sum()))
    slack = 1e-9 * float(np.abs(differences).sum())  # sums of the same numbers differ by rounding
    as_far = int((np.abs(signs @ differences) >= own - slack).sum())
    return as_far / len(signs) if exact else (as_far + 1) / (RESAMPLES + 1)


def holm_correction(p_values: Sequence[float]) -> list[float]:
    """Return p-values corrected over the rows of a table (Holm, 1979), in the same order.

    Rejecting those below a level keeps the probability of any false rejection below that level.
    """
    order = sorted(range(len(p_values)), key=lambda row: p_values[row])
    corrected, least = [1.0] * len(p_values), 0.0
    for rank, row in enumerate(order):
        least = max(least, min(1.0, (len(p_values) - rank) * p_values[row]))
        corrected[row] = least
    return corrected
