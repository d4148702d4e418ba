"""Whether an output is one that a unit has by itself, and the range that it has."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pdtui.core.errors import PolicyError
from pdtui.core.units import split_flat_index
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.tui.cell_text import format_number

_LEAST_SECONDS = 2.0  # of the drive without a stimulation, before the range says anything


class NaturalOutputs:
    """The bounds of the units' activation functions, and the ranges of their outputs in this drive."""

    def __init__(self, facts: DriveFacts, snapshot: DriveSnapshot) -> None:
        self._bounds: Sequence[tuple[float, float]] = facts.output_bounds
        self._layers = facts.layers
        ranges = snapshot.natural_ranges
        known = ranges is not None and ranges.steps * facts.dt >= _LEAST_SECONDS
        self._ranges = ranges if known else None

    def range_of(self, unit: int) -> tuple[float, float] | None:
        """Return the range of a unit in this drive, or before that is known, its bounds, if it has both."""
        if self._ranges is not None and unit < len(self._ranges.low):
            found = float(self._ranges.low[unit]), float(self._ranges.high[unit])
            return found if math.isfinite(found[0]) and math.isfinite(found[1]) else None
        low, high = self._bounds_of(unit)
        return (low, high) if math.isfinite(low) and math.isfinite(high) else None

    def has(self, unit: int, value: float) -> bool:
        """Return whether the unit can have an output by itself, as far as is known."""
        low, high = self.range_of(unit) or self._bounds_of(unit)
        return low <= value <= high

    def describe_range(self, unit: int) -> str:
        """Return the range in words; nothing if it is not known."""
        found = self.range_of(unit)
        return "" if found is None else f"{format_number(found[0])}…{format_number(found[1])}"

    def _bounds_of(self, unit: int) -> tuple[float, float]:
        try:
            layer = split_flat_index(unit, self._layers)[0]
        except PolicyError:
            layer = len(self._bounds)
        return self._bounds[layer] if layer < len(self._bounds) else (-math.inf, math.inf)
