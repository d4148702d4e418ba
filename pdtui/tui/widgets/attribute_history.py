"""The latest values of the attributes, of the drive and of its ghost."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.driving.drive_snapshot import DriveSnapshot


class AttributeHistory:
    """The last `length` values of each of `columns` attributes, and their range so far.

    The ghost's values lie beside the drive's of the same control step.
    """

    def __init__(self, length: int, columns: int) -> None:
        self._rows = np.full((length, columns), np.nan)
        self._ghost: Floats | None = None
        self._ghost_first = -1
        self.total = 0
        """Number of control steps so far."""
        self.until: int | None = None
        """Number of control steps with which `means` ends; None for all."""
        self.low = np.full(columns, np.inf)
        self.high = np.full(columns, -np.inf)

    def add_snapshot(self, snapshot: DriveSnapshot) -> None:
        """Add the history since the last snapshot; `means` ends where a past moment is shown."""
        self.extend(snapshot.history, snapshot.step)
        self.until = None if snapshot.past is None else snapshot.step
        ghost = snapshot.ghost
        first = -1 if ghost is None else ghost.first
        if first != self._ghost_first:
            self.forget_ghost()
            self._ghost_first = first
        if ghost is not None and ghost.latest is not None and ghost.history is not None:
            self.add_ghost(ghost.history, ghost.latest.step)

    def extend(self, rows: Floats, total: int | None = None) -> None:
        """Append rows, shape (n, J); if `total` steps are more than are known then, some were lost before."""
        if not len(rows):
            return
        self.low = np.fmin(self.low, np.fmin.reduce(rows))
        self.high = np.fmax(self.high, np.fmax.reduce(rows))
        lost = 0 if total is None else max(0, total - self.total - len(rows))
        self.total += lost + len(rows)
        self._rows = self._append(self._rows, rows, lost)
        if self._ghost is not None:
            self._ghost = self._append(self._ghost, np.full_like(rows, np.nan), lost)

    def _append(self, old: Floats, rows: Floats, lost: int) -> Floats:
        length, gap = len(old), np.full((min(lost, len(old)), old.shape[1]), np.nan)
        return np.concatenate([old, gap, rows])[-length:]

    def add_ghost(self, rows: Floats, step: int) -> None:
        """Add values of the ghost, shape (n, J), which end with the drive's `step`-th."""
        if self._ghost is None:
            self._ghost = np.full_like(self._rows, np.nan)
        length = len(self._ghost)
        end = length - (self.total - step)
        if end > length:  # the drive's own are not known
            rows, end = rows[: len(rows) - (end - length)], length
        kept = rows[-end:] if end > 0 else rows[:0]
        if len(kept):
            self._ghost[end - len(kept) : end] = kept

    def forget_ghost(self) -> None:
        """Drop all values of the ghost."""
        self._ghost = None

    def cell_of(self, step: int, cells: int, per_cell: int) -> int:
        """Return the cell in which `means` has a control step; less than 0 if it lies before the first."""
        total = self.total if self.until is None else self.until
        return cells - 1 - ((total - 1) // per_cell - step // per_cell)

    def means(self, cells: int, per_cell: int, *, ghost: bool = False) -> Floats:
        """Return means of the last cells × per_cell rows, shape (cells, J); NaN where there are no values.

        Cells begin at multiples of `per_cell` since the start, so that means do not change while they
        scroll.
        """
        rows = self._rows
        if ghost:
            rows = np.full_like(rows, np.nan) if self._ghost is None else self._ghost
        total = self.total if self.until is None else min(self.until, self.total)
        rows = rows[: max(0, len(rows) - (self.total - total))]
        partial = total % per_cell or per_cell
        wanted = (cells - 1) * per_cell + partial
        tail = rows[-wanted:]
        missing = cells * per_cell - len(tail)
        head, end = missing - (per_cell - partial), per_cell - partial
        filled = np.pad(tail, ((max(head, 0), end), (0, 0)), constant_values=np.nan)
        groups = filled.reshape(cells, per_cell, -1)
        known = np.isfinite(groups)
        count = known.sum(axis=1)
        sums = np.where(known, groups, 0.0).sum(axis=1)
        return np.where(count > 0, sums / np.maximum(count, 1), np.nan)
