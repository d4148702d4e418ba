"""The units on the bench: those that are held, and those that were picked to be."""

from __future__ import annotations

from dataclasses import dataclass
from time import monotonic

from pdtui.driving.drive_snapshot import DriveSnapshot

_SECONDS_AHEAD = 1.5
"""Time in which the drive may not know yet what was edited here."""


@dataclass
class BenchUnit:
    """A unit on the bench.

    Attributes:
        unit: flat index.
        value: the output v at which it is, or would be, held.
        held: whether it is held.
        edited: when it was edited last, by the clock of this process.
    """

    unit: int
    value: float
    held: bool = False
    edited: float = float("-inf")


class BenchUnits:
    """The rows of the bench, in the order in which the units were picked."""

    def __init__(self) -> None:
        self.rows: list[BenchUnit] = []
        self._forgotten: dict[int, float] = {}

    def pick(self, unit: int, value: float) -> int:
        """Return the row of a unit, which is appended with this value if there is none."""
        for row, one in enumerate(self.rows):
            if one.unit == unit:
                return row
        self.rows.append(BenchUnit(unit, value))
        return len(self.rows) - 1

    def edit(self, row: int, value: float, *, held: bool) -> None:
        """Note an edit that was sent to the drive."""
        one = self.rows[row]
        one.value, one.held, one.edited = value, held, monotonic()

    def forget(self, row: int) -> None:
        """Take a unit off the bench; where it is held still, it comes back."""
        self._forgotten[self.rows.pop(row).unit] = monotonic()

    def follow(self, snapshot: DriveSnapshot) -> None:
        """Take over what the drive holds, except where an edit is still on its way."""
        held = dict(snapshot.held_units)
        now = monotonic()
        for unit, value in held.items():
            if now - self._forgotten.get(unit, float("-inf")) > _SECONDS_AHEAD:
                self.pick(unit, value)
        for one in self.rows:
            if now - one.edited > _SECONDS_AHEAD:
                one.held = one.unit in held
                one.value = held.get(one.unit, one.value)

    def held(self) -> dict[int, float]:
        """Return the outputs of the units that are held, by flat index."""
        return {one.unit: one.value for one in self.rows if one.held}
