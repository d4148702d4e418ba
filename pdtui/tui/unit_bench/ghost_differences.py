"""How much the drive differs from its ghost, attribute by attribute, since the ghost began."""

from __future__ import annotations

from collections import deque

import numpy as np

from pdtui.core.attributes import Attribute, Floats, wrap_angles
from pdtui.driving.drive_snapshot import DriveSnapshot

_ROWS_KEPT = 4096  # control steps


class GhostDifferences:
    """Sums up the differences over the control steps that drive and ghost have both done."""

    def __init__(self) -> None:
        self._own: deque[tuple[int, Floats]] = deque(maxlen=_ROWS_KEPT)
        self._low: Floats | None = None
        self._high: Floats | None = None
        self.first = -1
        """The control step before which the ghost began; −1 without one."""
        self.steps = 0
        """Number of control steps that were compared."""
        self._sum: Floats | None = None

    def add(self, snapshot: DriveSnapshot, attributes: tuple[Attribute, ...]) -> None:
        """Add what is new in a snapshot."""
        rows = snapshot.history
        self._own.extend(zip(range(snapshot.step - len(rows), snapshot.step), rows, strict=True))
        if len(rows):
            low, high = np.fmin.reduce(rows), np.fmax.reduce(rows)
            self._low = low if self._low is None else np.fmin(self._low, low)
            self._high = high if self._high is None else np.fmax(self._high, high)
        ghost = snapshot.ghost
        first = -1 if ghost is None else ghost.first
        if first != self.first:
            self.first, self.steps, self._sum = first, 0, None
        if ghost is None or ghost.latest is None or ghost.history is None or not len(ghost.history):
            return
        own = dict(self._own)
        angles = np.array([one.wraps for one in attributes])
        for step, other in enumerate(ghost.history, ghost.latest.step - len(ghost.history)):
            if step in own:
                with np.errstate(invalid="ignore"):
                    change = own[step] - other
                    change[angles] = wrap_angles(change[angles])
                self._sum = change if self._sum is None else self._sum + change
                self.steps += 1

    def means(self) -> Floats | None:
        """Return the mean difference of each attribute, drive minus ghost, shape (J,); None before any."""
        return None if self._sum is None else self._sum / self.steps

    def ranked(self) -> list[int]:
        """Return the columns of the attributes, that with the largest difference for its range first."""
        means = self.means()
        if means is None or self._low is None or self._high is None:
            return []
        span = np.maximum(self._high - self._low, 1e-9)
        return [int(column) for column in np.argsort(-np.abs(np.nan_to_num(means)) / span)]
