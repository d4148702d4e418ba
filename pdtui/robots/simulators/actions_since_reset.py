"""The actions since a reset, kept so that a snapshot of them costs nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pdtui.core.attributes import Floats


class ActionsSinceReset:
    """Grows by appending only, so that what `so_far` gave stays as it was and shares its memory."""

    def __init__(self, width: int) -> None:
        self._rows: Floats = np.empty((64, width))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, action: ArrayLike) -> None:
        if self._count == len(self._rows):
            self._rows = np.concatenate((self._rows, np.empty_like(self._rows)))
        self._rows[self._count] = np.ravel(action)
        self._count += 1

    def so_far(self) -> Floats:
        """The actions up to now, shape (steps, width)."""
        return self._rows[: self._count]
