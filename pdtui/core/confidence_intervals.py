"""Confidence intervals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.core.attributes import Floats


def confidence_interval(values: Floats) -> tuple[float, float]:
    """Return the 95 % confidence interval of the mean (Student's t), infinite for fewer than 2 values."""
    if len(values) < 2:
        return float("-inf"), float("inf")
    half = float(stats.t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
    return float(values.mean()) - half, float(values.mean()) + half


def bootstrap_interval(
    samples: NDArray[Any], seed: int, *, level: float = 0.95, draws: int = 2000
) -> tuple[float, float]:
    """Return the percentile bootstrap interval of a mean.

    Args:
        samples: shape (K,); values that are not finite are left out.
        seed: seed of the resampling.
        level: coverage of the interval.
        draws: number of resamples.

    Returns:
        The ends of the interval; NaN for fewer than two samples.
    """
    known = np.asarray(samples, np.float64)
    known = known[np.isfinite(known)]
    if known.size < 2:
        return float("nan"), float("nan")
    drawn = stats.bootstrap(
        (known,), np.mean, n_resamples=draws, confidence_level=level, method="percentile", rng=seed
    ).confidence_interval
    return float(drawn.low), float(drawn.high)
