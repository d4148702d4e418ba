"""Mean and standard deviation of values that come in blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats


class RunningMoments:
    """The moments of J columns over the rows in which each is finite.

    Blocks are combined as in Chan, Golub and LeVeque, "Updating Formulae and a Pairwise Algorithm for
    Computing Sample Variances" (1979), which loses no digits for values far from 0.
    """

    def __init__(self, columns: int) -> None:
        self.counts: NDArray[np.int64] = np.zeros(columns, np.int64)
        self._mean, self._squares = np.zeros(columns), np.zeros(columns)

    def add(self, values: Floats) -> None:
        """Add rows, shape (n, J), n > 0."""
        finite = np.isfinite(values)
        counts = finite.sum(axis=0)
        if not finite.all():
            values = np.where(finite, values, 0.0)
        total = np.maximum(self.counts + counts, 1)
        with np.errstate(over="ignore", invalid="ignore"):
            mean = values.sum(axis=0) / np.maximum(counts, 1)
            change = mean - self._mean
            squares = (np.where(finite, values - mean, 0.0) ** 2).sum(axis=0)
            self._squares += squares + change**2 * (self.counts * counts / total)
            self._mean += change * (counts / total)
        self.counts += counts

    @property
    def mean(self) -> Floats:
        """The mean of each column, shape (J,); NaN where no value is finite."""
        return np.where(self.counts > 0, self._mean, np.nan)

    @property
    def deviation(self) -> Floats:
        """The standard deviation of each column, shape (J,); NaN where no value is finite."""
        return np.where(self.counts > 0, np.sqrt(self._squares / np.maximum(self.counts, 1)), np.nan)
