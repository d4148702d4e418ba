"""Which distances are too close to each other for the precision that they were computed in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats

_PRECISE = 1e-4
"""Relative error above which a distance is computed again, whatever its rank."""


def find_near_ties(distance: Floats, bound: Floats, ranks: int) -> NDArray[np.bool_]:
    """Return the units whose rank is uncertain, shape (U,).

    Args:
        distance: distances of J attributes and U units, shape (J, U).
        bound: largest error of each, shape (J, U).
        ranks: number of nearest units of each attribute that matter.
    """
    tied = np.zeros(distance.shape[1], bool)
    for values, errors in zip(distance, bound, strict=True):
        vague = ~(errors <= _PRECISE * values)
        known = np.flatnonzero(np.isfinite(values + errors))
        order = known[np.argsort(values[known], kind="stable")]
        # Between two neighbors, the order is certain if none before can be above any after.
        highest = np.maximum.accumulate(values[order] + errors[order])
        lowest = np.minimum.accumulate((values[order] - errors[order])[::-1])[::-1]
        overlaps = highest[:-1] >= lowest[1:]
        uncertain = np.zeros(len(order), bool)
        uncertain[:-1] |= overlaps
        uncertain[1:] |= overlaps
        tied[order[:ranks][uncertain[:ranks]]] = True
        tied |= vague
    return tied
