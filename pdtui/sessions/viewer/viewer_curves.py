"""Curves that come and go, and a picture of all activations, for the viewer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from pdtui.sessions.writer.arrow_columns import ComponentColumn, number_list_column

Key = TypeVar("Key")
Send = Callable[[str, Sequence[int], list[ComponentColumn]], None]
LogStatic = Callable[[str, Any], None]

Color = tuple[int, int, int]

_HEAT_COLUMNS = 768
_SAMPLED = 1_000_000
_CLIPPED = 0.01
"""Share of activations that the heat map clips: what overwrites a unit may be twenty times the others."""


class ViewerCurves(Generic[Key]):
    """One entity for each key, one curve for each field, a gap where a key has no values.

    Args:
        entity: parent of the entities.
        label: name of a key.
        color: of a key.
        fields: names of the values; of several, the last is drawn brightest.
        send: writes a batch of rows.
        log_static: writes what holds at all times.
    """

    def __init__(
        self,
        entity: str,
        label: Callable[[Key], str],
        color: Callable[[Key], Color],
        fields: tuple[str, ...],
        send: Send,
        log_static: LogStatic,
    ) -> None:
        self._entity, self._label, self._color, self._fields = entity, label, color, fields
        self._send, self._log_static = send, log_static
        self._gap = (math.nan,) * len(fields)
        self._rows: dict[Key, list[tuple[int, tuple[Any, ...]]]] = {}
        self._last: tuple[Key, ...] = ()

    @property
    def keys(self) -> tuple[Key, ...]:
        """All that had values so far."""
        return tuple(self._rows)

    @property
    def drawing(self) -> bool:
        """Whether the last control step had values: if so, the next has to be added, be it empty."""
        return bool(self._last)

    def add(self, step: int, values: Mapping[Key, tuple[Any, ...]]) -> None:
        """Take in the values of one control step by key."""
        for key in self._last:
            if key not in values:
                # A gap, or the viewer would draw a line to where the curve comes back.
                self._rows[key].append((step, self._gap))
        for key, row in values.items():
            if key not in self._rows:
                self._start(key)
            self._rows[key].append((step, row))
        self._last = tuple(values)

    def finish(self, step: int) -> None:
        """End all curves at the session's last step."""
        for buffered in self._rows.values():
            buffered.append((step, self._gap))

    def write(self) -> None:
        """Write what was added since the last time."""
        for key, buffered in self._rows.items():
            if buffered:
                steps, values = zip(*buffered, strict=True)
                block = np.array(values, np.float64)
                self._send(
                    self._entity_of(key), steps, [number_list_column(rr.Scalars.descriptor_scalars(), block)]
                )
                self._rows[key] = []

    def _start(self, key: Key) -> None:
        names = [f"{self._label(key)} {field}".rstrip() for field in self._fields]
        shades = _shades(self._color(key), len(names))
        self._log_static(self._entity_of(key), rr.SeriesLines(names=names, colors=shades))
        # From the session's first step, so that plots one above the other cover the same time.
        self._rows[key] = [(0, self._gap)]

    def _entity_of(self, key: Key) -> str:
        return f"{self._entity}/{rr.escape_entity_path_part(self._label(key))}"


class ActivationHeatMap:
    """All activations over the whole session, thinned out as it grows."""

    def __init__(self) -> None:
        self._stride = 1
        self._columns: list[NDArray[np.float32]] = []

    def add(self, step: int, activations: NDArray[np.float32]) -> None:
        """Take in the activations of one control step, shape (U,)."""
        if step % self._stride == 0:
            self._columns.append(activations)
            if len(self._columns) > _HEAT_COLUMNS:
                self._columns = self._columns[::2]
                self._stride *= 2

    def picture(self) -> NDArray[np.uint8] | None:
        """Units from top to bottom, time from left to right; 128 is zero.

        1 and 255 are the largest magnitudes but for a few, which are clipped.
        """
        if not self._columns:
            return None
        values = np.concatenate(self._columns).reshape(len(self._columns), -1)
        if not np.isfinite(values).all():
            np.nan_to_num(values, copy=False)
        # In place, and turned only when the numbers are small: this is the last thing that a drive waits for.
        sizes = np.abs(values.ravel()[:: 1 + values.size // _SAMPLED])
        largest = len(sizes) - 1 - int(_CLIPPED * len(sizes))
        sizes.partition(largest)
        values *= 127 / max(float(sizes[largest]), 1e-9)
        np.clip(values, -127, 127, out=values)
        values += 128
        picture: NDArray[np.uint8] = np.rint(values, out=values).astype(np.uint8)
        return np.ascontiguousarray(picture.T)


def _shades(color: Color, count: int) -> list[Color]:
    """From faint to full: curves that belong together look alike."""
    return [tuple(part * (level + 1) // count for part in color) for level in range(count)]  # type: ignore[misc]
