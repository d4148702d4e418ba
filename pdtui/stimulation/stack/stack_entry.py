"""The stack of what acts on hidden units, as the screen shows it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple


class PidTuning(NamedTuple):
    """The gains of a controller as they are now, and the limit of the magnitude c."""

    kp: float
    ki: float
    kd: float
    limit: float


class StackEntry(NamedTuple):
    """A latched behavior in the stack.

    Attributes:
        name: name of the behavior.
        factor: factor on its magnitudes.
        muted: whether it is latched but does not act.
        units: flat indices of the hidden units that it can change.
        gains: the gains of its controller; None for one of mode ``fixed``.
    """

    name: str
    factor: float
    muted: bool
    units: tuple[int, ...]
    gains: PidTuning | None = None


def is_muted(name: str, stack: Sequence[StackEntry]) -> bool:
    """Return whether a behavior is latched but does not act."""
    return any(layer.muted for layer in stack if layer.name == name)


def find_conflicts(stack: Sequence[StackEntry], held: Sequence[int] = ()) -> frozenset[int]:
    """Return the units that more than one layer that acts can change; held units are a layer of their own.

    On each of them, the layer that comes last decides, unless it adds to what is there.
    """
    counts = Counter(unit for layer in stack if not layer.muted for unit in set(layer.units))
    counts.update(held)
    return frozenset(unit for unit, count in counts.items() if count > 1)
