"""Follows the gait: how long ago a moment of it came, and at which phase of its cycle the robot is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

CrossingDirection = Literal["up", "down"]


@dataclass(frozen=True)
class GaitMark:
    """A moment that comes once in every cycle of the gait: a signal crosses a level.

    Attributes:
        signal: Name of an attribute, or address of a hidden unit.
        crosses: Direction of the crossing.
        level: The level, in the signal's unit.
        minimum_spacing: Least time between two moments, s, so that a foot that bounces counts once.
    """

    signal: str
    crosses: CrossingDirection = "up"
    level: float = 0.0
    minimum_spacing: float = 0.1


class GaitClock:
    """Counts the control steps since the last moment of a mark.

    Attributes:
        control_steps_since: Steps since the last moment, 0 in which it comes; None before the first.
        period: Control steps between the last two moments; None before the second.

    Args:
        mark: The moment to wait for.
        dt: Duration of a control step, s.
    """

    def __init__(self, mark: GaitMark, dt: float) -> None:
        self._mark, self._apart = mark, mark.minimum_spacing / dt
        self._last: float | None = None
        self.control_steps_since: int | None = None
        self.period: int | None = None

    @property
    def phase(self) -> float | None:
        """The phase in [0, 1): 0 at the moment, and just under 1 when the next is due or late."""
        if self.control_steps_since is None or self.period is None:
            return None
        return min(self.control_steps_since / self.period, 1.0 - 1e-9)

    def update(self, value: float) -> None:
        """Take the signal's value before a control step; call it once per control step."""
        level, last = self._mark.level, self._last
        self._last = value
        if self.control_steps_since is not None:
            self.control_steps_since += 1
        if last is None:
            return
        crossed = last <= level < value if self._mark.crosses == "up" else last >= level > value
        if crossed and (self.control_steps_since is None or self.control_steps_since >= self._apart):
            self.period, self.control_steps_since = self.control_steps_since, 0

    def control_steps_until(self, delay: int) -> int | None:
        """Return the control steps until a delay after a moment is over, as the last period predicts it.

        Returns:
            0 in the very step; None while that cannot be known.
        """
        if self.control_steps_since is None:
            return None
        if self.control_steps_since <= delay:
            return delay - self.control_steps_since
        return None if self.period is None else max(1, self.period - self.control_steps_since) + delay
