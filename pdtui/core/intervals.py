"""Confidence intervals."""

from __future__ import annotations

import numpy as np
from scipy import stats

from pdtui.core.attributes import Floats


def confidence_interval(values: Floats) -> tuple[float, float]:
    """95 % interval of the mean, Student's t; as wide as can be for a single value."""
    if len(values) < 2:
        return float("-inf"), float("inf")
    half = float(stats.t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
    return float(values.mean()) - half, float(values.mean()) + half
