"""A picture of all activations over a session, for the viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_COLUMNS = 768
"""Width of the picture, pixels; a longer session is thinned out."""
_SAMPLED = 1_000_000
"""Number of activations from which the brightness is determined."""
_CLIPPED = 0.01
"""Share of activations that are clipped: the value that overwrites a unit may be twenty times the others."""


class ActivationHeatMap:
    """Collects the activations of a whole session, thinned out as it grows."""

    def __init__(self) -> None:
        self._stride = 1
        self._columns: list[NDArray[np.float32]] = []

    def add(self, step: int, activations: NDArray[np.float32]) -> None:
        """Add the activations of one control step, shape (U,)."""
        if step % self._stride == 0:
            self._columns.append(activations)
            if len(self._columns) > _COLUMNS:
                self._columns = self._columns[::2]
                self._stride *= 2

    def picture(self) -> NDArray[np.uint8] | None:
        """Return the picture, with units from top to bottom and time from left to right; None if it is empty.

        Zero is drawn as 128, the largest magnitudes as 1 and 255; a few larger ones are clipped.
        """
        if not self._columns:
            return None
        values = np.concatenate(self._columns).reshape(len(self._columns), -1)
        if not np.isfinite(values).all():
            np.nan_to_num(values, copy=False)
        # In place, and transposed only as bytes: a drive waits for this when it ends.
        sizes = np.abs(values.ravel()[:: 1 + values.size // _SAMPLED])
        largest = len(sizes) - 1 - int(_CLIPPED * len(sizes))
        sizes.partition(largest)
        values *= 127 / max(float(sizes[largest]), 1e-9)
        np.clip(values, -127, 127, out=values)
        values += 128
        picture: NDArray[np.uint8] = np.rint(values, out=values).astype(np.uint8)
        return np.ascontiguousarray(picture.T)
