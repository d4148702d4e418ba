"""The pace of a drive: real time, slower, faster, paused, or single steps."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

PaceRequest = Literal["pause", "step", "slower", "faster"]
SLOWEST, FASTEST = 1 / 16, 16.0
_LONGEST_LAG = 0.25  # that is caught up by faster steps, s


class Pacer:
    """Decides when the next control step is due; the caller passes the time, so no clock is read.

    Args:
        dt: simulated time of a control step, s.
        now: present time, s.
        keeps_times: whether to keep when each step was done, for a benchmark.
    """

    def __init__(self, dt: float, now: float, *, keeps_times: bool = False) -> None:
        self._dt = dt
        self.speed, self.paused = 1.0, False
        self._due = now
        self._single = 0
        self._marks: list[float] = []
        self._times: list[tuple[float, float]] | None = [] if keeps_times else None

    def change_pace(self, pace: PaceRequest, now: float) -> None:
        """Change the pace; a single step pauses first."""
        match pace:
            case "pause":
                self.paused = not self.paused
            case "step":
                self._single += self.paused
                self.paused = True
            case "slower":
                self.speed = max(SLOWEST, self.speed / 2)
            case "faster":
                self.speed = min(FASTEST, self.speed * 2)
            case _:
                raise ValueError(f"unknown pace '{pace}'; available: {', '.join(get_args(PaceRequest))}")
        self._due = now
        self._marks = []

    def seconds_until_due(self, now: float) -> float | None:
        """Return the seconds until the next step, 0 if it is due, or None while paused."""
        if self._single:
            return 0.0
        return None if self.paused else max(0.0, self._due - now)

    def note_step(self, now: float) -> None:
        """Note that a control step was done."""
        if self._single:
            self._single -= 1
            return
        if self._times is not None:
            self._times.append((now, now - self._due))
        self._due += self._dt / self.speed
        if now - self._due > _LONGEST_LAG:
            self._due = now  # too slow for this speed: continue from here rather than catch up
        self._marks = [*self._marks[-40:], now]

    def save_times(self, path: str) -> None:
        """Write when each step was done, and how much later than it was due, s, as an array (n, 2)."""
        if self._times is not None:
            np.save(path, np.array(self._times, float).reshape(-1, 2))

    @property
    def achieved_speed(self) -> float:
        """The speed of the latest steps, in multiples of real time."""
        if self.paused or len(self._marks) < 2 or self._marks[-1] <= self._marks[0]:
            return 0.0 if self.paused else self.speed
        return (len(self._marks) - 1) * self._dt / (self._marks[-1] - self._marks[0])
