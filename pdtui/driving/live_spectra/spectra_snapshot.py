"""What the screen is told of the spectrograms of a unit and an attribute, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pdtui.core.attributes import Floats


class SpectraChoice(NamedTuple):
    """What is to be compared: the row of an attribute, and a unit's flat index, −1 for the nearest unit."""

    attribute: int
    unit: int = -1


class RankedUnit(NamedTuple):
    """A unit by its flat index, and its discrepancy with the attribute."""

    unit: int
    discrepancy: float


@dataclass(frozen=True)
class SpectraSnapshot:
    """Spectrograms over the last windows of an episode, up to the moment that is shown.

    Attributes:
        choice: what was asked for.
        message: why there is nothing to show; else empty.
        moment: number of control steps done at the end of the last window.
        steps: number of control steps that the windows cover.
        unit: flat index of the unit.
        frequencies: in Hz, shape (F,).
        attribute_power, unit_power: spectrograms in D windows, shape (D, F), in the units of the method.
        ranking: units by their discrepancy with the attribute over these windows, the nearest first.
        discrepancy: that of the unit; NaN if it cannot be compared.
    """

    choice: SpectraChoice
    message: str = ""
    moment: int = 0
    steps: int = 0
    unit: int = -1
    frequencies: Floats | None = None
    attribute_power: Floats | None = None
    unit_power: Floats | None = None
    ranking: tuple[RankedUnit, ...] = ()
    discrepancy: float = float("nan")
