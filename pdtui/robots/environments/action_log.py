"""The actions since a reset, stored so that a snapshot of them costs nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pdtui.core.attributes import Floats


class ActionLog:
    """An append-only array of actions, so that what `so_far` returned never changes and shares its memory."""

    def __init__(self, width: int) -> None:
        self._rows: Floats = np.empty((64, width))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, action: ArrayLike) -> None:
        """Append an action, any shape of `width` numbers."""
        if self._count == len(self._rows):
            self._rows = np.concatenate((self._rows, np.empty_like(self._rows)))
        self._rows[self._count] = np.ravel(action)
        self._count += 1

    def so_far(self) -> Floats:
        """Return the actions up to now, shape (steps, width)."""
        return self._rows[: self._count]
