"""The numbers of the control steps of a session from which some may be missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def number_steps(first_row: int, rows: int, gaps: Sequence[tuple[int, int]]) -> NDArray[np.int64]:
    """Return the numbers of recorded control steps, shape (rows,), without the `gaps`."""
    numbers = np.arange(first_row, first_row + rows, dtype=np.int64)
    for start, stop in sorted(gaps):
        numbers[numbers >= start] += stop - start
    return numbers


def describe_step_ranges(ranges: Sequence[tuple[int, int]]) -> str:
    """Return half-open ranges in words, such as ``3 steps: 4, 10 to 11``."""
    count = sum(stop - start for start, stop in ranges)
    named = (str(start) if stop == start + 1 else f"{start} to {stop - 1}" for start, stop in ranges)
    return f"{count} {'step' if count == 1 else 'steps'}: {', '.join(named)}"
