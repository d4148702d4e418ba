"""The difference of one value between two runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

StreamValue = float | int | str

_HALF = 2.0**-10
"""Tolerance of float16 values: two numbers that differ by rounding may be rounded to neighbors."""


@dataclass(frozen=True)
class StreamDifference:
    """The first value that differs between two runs.

    Attributes:
        step: the control step.
        stream: the stream: ``activations``, ``attributes``, ``behaviors`` and so on.
        column: what differs within the stream: the name of the attribute, the address of the unit, the
            behavior with its field; empty if the stream has one value per step.
        here, recorded: the value of the run and of the session; of two sessions, of the first and the second.
    """

    step: int
    stream: str
    column: str
    here: StreamValue
    recorded: StreamValue

    @property
    def place(self) -> str:
        """Stream and column."""
        return f"{self.stream} {self.column}".rstrip()

    def __str__(self) -> str:
        here, recorded = (_format_value(value) for value in (self.here, self.recorded))
        return f"{self.place} is {here}, recorded {recorded}"

    def between_sessions(self) -> str:
        """Return the difference between two sessions in words."""
        first, second = (_format_value(value) for value in (self.here, self.recorded))
        return f"{self.place} is {first} in the first, {second} in the second"


def differing_values(a: NDArray[Any], b: NDArray[Any], tolerance: float | None) -> NDArray[np.bool_]:
    """Tell of each element of two arrays whether it differs, where NaN equals NaN.

    Numbers must have the same bits, or, where a tolerance is given, floating-point numbers may differ by so
    much, or by such a share of a value beyond ±1.
    """
    wrong: NDArray[np.bool_]
    if a.dtype.kind != "f":
        wrong = a != b
        return wrong
    if tolerance is not None:
        room = max(tolerance, _HALF if a.dtype == np.float16 else 0.0)
        x, y = a.astype(np.float64), b.astype(np.float64)
        with np.errstate(invalid="ignore"):
            near = np.abs(x - y) <= room * np.maximum(1.0, np.abs(x))
        wrong = ~(near | (x == y) | (np.isnan(x) & np.isnan(y)))
        return wrong
    bits = f"i{a.dtype.itemsize}"
    wrong = np.ascontiguousarray(a).view(bits) != np.ascontiguousarray(b).view(bits)
    return wrong & ~(np.isnan(a) & np.isnan(b)) if wrong.any() else wrong


def _format_value(value: StreamValue) -> str:
    return f"'{value}'" if isinstance(value, str) and value != "none" else str(value)
