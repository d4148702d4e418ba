"""Figures of an experiment over its repeats."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class RepeatStatistics:
    """Mean over repeats and their standard deviation (n − 1), which is NaN for a single repeat."""

    mean: float
    std: float

    def __format__(self, form: str) -> str:
        """Return ``mean ± deviation``, each in the form of a float, without a deviation that is NaN."""
        spread = "" if math.isnan(self.std) else f" ± {self.std:{form}}"
        return f"{self.mean:{form}}{spread}"


def summarize_repeats(means: ArrayLike) -> RepeatStatistics:
    """Return the statistics of the means of repeats, one number for each, shape (repeats,)."""
    values = np.asarray(means, np.float64)
    std = float(values.std(ddof=1)) if len(values) > 1 else math.nan
    return RepeatStatistics(float(values.mean()), std)
