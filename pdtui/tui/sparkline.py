"""The recent history of attributes, and sparklines of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_LEVELS = np.array([ord(character) for character in " ▁▂▃▄▅▆▇█"], "<u4")
_LEAST_SHARE = 0.05


class AttributeHistory:
    """The last `length` values of J attributes.

    Args:
        length: number of rows to keep.
        columns: J.
    """

    def __init__(self, length: int, columns: int) -> None:
        self._rows = np.full((length, columns), np.nan)
        self.total = 0
        self.low = np.full(columns, np.inf)
        self.high = np.full(columns, -np.inf)

    def extend(self, rows: Floats) -> None:
        """Append rows, shape (n, J)."""
        if not len(rows):
            return
        self.total += len(rows)
        kept = rows[-len(self._rows) :]
        self._rows = np.concatenate([self._rows[len(kept) :], kept])
        self.low = np.fmin(self.low, np.fmin.reduce(rows))
        self.high = np.fmax(self.high, np.fmax.reduce(rows))

    def means(self, cells: int, per_cell: int) -> Floats:
        """Return means of the last cells × per_cell rows, shape (cells, J); NaN where there are no values.

        Cells begin at multiples of `per_cell` since the start, so that means do not change while they
        scroll.
        """
        partial = self.total % per_cell or per_cell
        wanted = (cells - 1) * per_cell + partial
        tail = self._rows[-wanted:]
        missing = cells * per_cell - len(tail)
        head, end = missing - (per_cell - partial), per_cell - partial
        filled = np.pad(tail, ((max(head, 0), end), (0, 0)), constant_values=np.nan)
        groups = filled.reshape(cells, per_cell, -1)
        known = np.isfinite(groups)
        count = known.sum(axis=1)
        total = np.where(known, groups, 0.0).sum(axis=1)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def draw_sparklines(means: Floats, low: Floats, high: Floats) -> list[str]:
    """Return one line of block characters per column of means (cells, J).

    Each is scaled to the values shown, but to no less than a twentieth of the range `low` to `high` seen so
    far, so that noise stays small.
    """
    known = np.isfinite(means)
    bottom = np.where(known, means, np.inf).min(axis=0)
    top = np.where(known, means, -np.inf).max(axis=0)
    with np.errstate(invalid="ignore"):
        least = np.maximum(_LEAST_SHARE * (high - low), 1e-9)
        span = np.maximum(top - bottom, least)
        middle = (top + bottom) / 2
        share = (means - (middle - span / 2)) / span
    level = np.where(known, 1 + np.clip(np.nan_to_num(share) * 8, 0, 7), 0).astype(np.int64)
    text = _LEVELS[level.T]
    return [row.tobytes().decode("utf-32-le") for row in text]
