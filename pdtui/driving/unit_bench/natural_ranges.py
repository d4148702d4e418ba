"""The range of what each hidden unit puts out by itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdtui.core.step_record import StepRecord


class NaturalRanges(NamedTuple):
    """The least and the largest output of each unit so far, while no unit was changed.

    Attributes:
        low, high: shape (U,).
        steps: number of control steps that they come from.
    """

    low: NDArray[np.float32]
    high: NDArray[np.float32]
    steps: int


class NaturalRangeTracker:
    """Follows the ranges over the control steps in which no unit is changed."""

    def __init__(self) -> None:
        self.ranges: NaturalRanges | None = None

    def add(self, record: StepRecord) -> None:
        """Add a control step."""
        if record.stimulation.units:
            return
        now, before = record.activations, self.ranges
        if before is None:
            self.ranges = NaturalRanges(now, now, 1)
        else:
            # New arrays, since another thread may still be sending the old ones.
            low, high = np.fmin(before.low, now), np.fmax(before.high, now)
            self.ranges = NaturalRanges(low, high, before.steps + 1)
