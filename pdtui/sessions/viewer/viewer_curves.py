"""Curves in the viewer that begin and end during a drive."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
import rerun as rr

from pdtui.sessions.writer.arrow_columns import ComponentColumn, number_list_column

CurveKey = TypeVar("CurveKey")
SendRows = Callable[[str, Sequence[int], list[ComponentColumn]], None]
LogStatic = Callable[[str, Any], None]

Color = tuple[int, int, int]


def pack_color(color: Color) -> int:
    """Return an opaque color as Rerun's columns keep it: red, green, blue and alpha in 32 bits."""
    red, green, blue = color
    return red << 24 | green << 16 | blue << 8 | 255


class ViewerCurves(Generic[CurveKey]):
    """Writes one entity per key and one curve per field, with gaps where a key has no values.

    Args:
        entity: path of the entities' parent.
        label: returns the name of a key.
        color: returns the color of a key.
        fields: names of the values; of several, the last is drawn brightest.
        send: writes a batch of rows.
        log_static: writes data that apply at all times.
    """

    def __init__(
        self,
        entity: str,
        label: Callable[[CurveKey], str],
        color: Callable[[CurveKey], Color],
        fields: tuple[str, ...],
        send: SendRows,
        log_static: LogStatic,
    ) -> None:
        self._entity, self._label, self._color, self._fields = entity, label, color, fields
        self._send, self._log_static = send, log_static
        self._gap = (math.nan,) * len(fields)
        self._rows: dict[CurveKey, list[tuple[int, tuple[Any, ...]]]] = {}
        self._last: tuple[CurveKey, ...] = ()

    @property
    def keys(self) -> tuple[CurveKey, ...]:
        """The keys that had values so far."""
        return tuple(self._rows)

    @property
    def drawing(self) -> bool:
        """Whether the last control step had values; if so, the next has to be added even if it is empty."""
        return bool(self._last)

    def add(self, step: int, values: Mapping[CurveKey, tuple[Any, ...]]) -> None:
        """Add the values of one control step by key."""
        for key in self._last:
            if key not in values:
                # Without a gap, the viewer would draw a line to where the curve resumes.
                self._rows[key].append((step, self._gap))
        for key, row in values.items():
            if key not in self._rows:
                self._start_curve(key)
            self._rows[key].append((step, row))
        self._last = tuple(values)

    def finish(self, step: int) -> None:
        """End all curves at the last step of the session."""
        for buffered in self._rows.values():
            buffered.append((step, self._gap))

    def write(self) -> None:
        """Write what was added since the last call."""
        for key, buffered in self._rows.items():
            if buffered:
                steps, values = zip(*buffered, strict=True)
                block = np.array(values, np.float64)
                self._send(
                    self._entity_of(key), steps, [number_list_column(rr.Scalars.descriptor_scalars(), block)]
                )
                self._rows[key] = []

    def _start_curve(self, key: CurveKey) -> None:
        names = [f"{self._label(key)} {field}".rstrip() for field in self._fields]
        shades = _shades(self._color(key), len(names))
        self._log_static(self._entity_of(key), rr.SeriesLines(names=names, colors=shades))
        # From the first step of the session, so that all plots cover the same time.
        self._rows[key] = [(0, self._gap)]

    def _entity_of(self, key: CurveKey) -> str:
        return f"{self._entity}/{rr.escape_entity_path_part(self._label(key))}"


def _shades(color: Color, count: int) -> list[Color]:
    """Return shades of a color from faint to full, so that curves that belong together look alike."""
    return [tuple(part * (level + 1) // count for part in color) for level in range(count)]  # type: ignore[misc]
