"""Confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pdtui.core.attributes import Floats

FEWEST_PAIRS = 8
"""Below this number of pairs, too many resamples consist of one pair."""
_DRAWS = 9_999


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


@dataclass(frozen=True)
class PairedRatio:
    """A ratio of means over the same starts, with its 95 % interval; NaN if both means are 0."""

    value: float
    low: float
    high: float


def paired_ratio(above: Floats, below: Floats, *, per: tuple[Floats, Floats] | None = None) -> PairedRatio:
    """Return the ratio of two means of positive values, with an interval over whole pairs.

    It is the studentized bootstrap interval of the ratio's logarithm, with the delta method's standard error
    (Davison and Hinkley, 1997, section 5.2). It covered the true ratio on 94 to 95 % of simulated samples of
    20 pairs, a percentile interval on 92 to 94 %. For fewer than `FEWEST_PAIRS`, Student's t is used.

    Args:
        above, below: one value per start, shape (n,) each, in the same order.
        per: what each value is counted per, such as the distance of a drive; rates are of sums.

    Returns:
        The ratio. Its interval is 0 to infinity for fewer than 2 pairs, and unless all means are positive.
    """
    parts = np.array([above, below] if per is None else [above, below, *per], np.float64)
    signs, count = np.array([1.0, -1.0, -1.0, 1.0])[: len(parts)], parts.shape[1]

    def logarithm_and_error(drawn: Floats) -> tuple[Floats, Floats]:
        means = drawn.mean(axis=-1)
        influence = np.tensordot(signs, drawn / means[..., None], 1)
        return np.tensordot(signs, np.log(means), 1), influence.std(axis=-1, ddof=1) / np.sqrt(count)

    with np.errstate(divide="ignore", invalid="ignore"):
        means = parts.mean(axis=1)
        value = float(np.prod(means**signs))
        if count < 2 or not (means > 0.0).all():
            return PairedRatio(value, 0.0, float("inf"))
        own, error = map(float, logarithm_and_error(parts))
        reach = stats.t.ppf(0.975, count - 1)
        ends = np.array([-reach, reach])
        if count >= FEWEST_PAIRS and error > 1e-12:
            indices = np.random.default_rng(0).integers(count, size=(_DRAWS, count))
            logarithms, errors = logarithm_and_error(parts[:, indices])
            scores = ((logarithms - own) / errors)[errors > 1e-12]
            ends = np.quantile(scores[~np.isnan(scores)], [0.025, 0.975], method="nearest")
        low, high = np.exp(own - error * ends[::-1]).tolist()
    return PairedRatio(value, low, high)
