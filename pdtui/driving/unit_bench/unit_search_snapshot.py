"""What the screen is told of a search for units, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SearchCondition = Literal["loading", "searching", "done", "failed"]


@dataclass(frozen=True)
class UnitSearchRequest:
    """What is searched for.

    Attributes:
        attribute: name of the attribute.
        sign: 1 for units that raise it, −1 for units that lower it.
        seconds: time that the search may take, s.
    """

    attribute: str
    sign: float
    seconds: float = 20.0


@dataclass(frozen=True)
class FoundUnit:
    """A unit and an output, and what it does from the moment at which the search began.

    Attributes:
        unit: flat index of the unit.
        value: the output v at which it is held.
        effect: mean change of the attribute over the second half of the roll-out, in its unit; for an angle,
            of the angle turned since the moment.
        fell: whether the robot failed with it, but not without it.
    """

    unit: int
    value: float
    effect: float
    fell: bool


@dataclass(frozen=True)
class UnitSearchSnapshot:
    """The state of a search for units.

    Attributes:
        condition: ``loading`` robot and policy; ``searching``; ``done``; ``failed``.
        message: why there is no search; else empty.
        request: what is searched for.
        step: the control step from which all roll-outs began; −1 before.
        rollouts: roll-outs done.
        steps: control steps of each roll-out.
        best: the best units so far, the best first.
    """

    condition: SearchCondition
    message: str = ""
    request: UnitSearchRequest | None = None
    step: int = -1
    rollouts: int = 0
    steps: int = 0
    best: tuple[FoundUnit, ...] = ()
