"""Curves that come and go, and a picture of all activations, for the viewer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from pdtui.sessions.columns import Column, rows

Key = TypeVar("Key")
Send = Callable[[str, Sequence[int], list[Column]], None]
LogStatic = Callable[[str, Any], None]

PALETTE = (
    (230, 159, 0),
    (86, 180, 233),
    (0, 158, 115),
    (204, 121, 167),
    (240, 228, 66),
    (0, 114, 178),
    (213, 94, 0),
)
_HEAT_COLUMNS = 768


class Curves(Generic[Key]):
    """One entity for each key, one curve for each field, a gap where a key has no values.

    Args:
        entity: parent of the entities.
        label: name of a key.
        fields: names of the values.
        send: writes a batch of rows.
        log_static: writes what holds at all times.
    """

    def __init__(
        self,
        entity: str,
        label: Callable[[Key], str],
        fields: tuple[str, ...],
        send: Send,
        log_static: LogStatic,
    ) -> None:
        self._entity, self._label, self._fields = entity, label, fields
        self._send, self._log_static = send, log_static
        self._rows: dict[Key, list[tuple[int, tuple[Any, ...]]]] = {}
        self._last: tuple[Key, ...] = ()

    @property
    def drawing(self) -> bool:
        """Whether the last control step had values: if so, the next has to be added, be it empty."""
        return bool(self._last)

    def add(self, step: int, values: Mapping[Key, tuple[Any, ...]]) -> None:
        """Take in the values of one control step by key."""
        for key in self._last:
            if key not in values:
                # A gap, or the viewer would draw a line to where the curve comes back.
                self._rows[key].append((step, (math.nan,) * len(self._fields)))
        for key, row in values.items():
            if key not in self._rows:
                self._start(key)
            self._rows[key].append((step, row))
        self._last = tuple(values)

    def write(self) -> None:
        """Write what was added since the last time."""
        for key, buffered in self._rows.items():
            if buffered:
                steps, values = zip(*buffered, strict=True)
                block = np.array(values, np.float64)
                self._send(self._entity_of(key), steps, [rows(rr.Scalars.descriptor_scalars(), block)])
                self._rows[key] = []

    def _start(self, key: Key) -> None:
        names = [f"{self._label(key)} {field}" for field in self._fields]
        pair = _shades(PALETTE[len(self._rows) % len(PALETTE)])
        colors = pair if len(names) == len(pair) else list(PALETTE[: len(names)])
        self._log_static(self._entity_of(key), rr.SeriesLines(names=names, colors=colors))
        self._rows[key] = []

    def _entity_of(self, key: Key) -> str:
        return f"{self._entity}/{rr.escape_entity_path_part(self._label(key))}"


class HeatMap:
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
        """Units from top to bottom, time from left to right; 128 is zero, the largest magnitude 1 or 255."""
        if not self._columns:
            return None
        values = np.concatenate(self._columns).reshape(len(self._columns), -1)
        if not np.isfinite(values).all():
            np.nan_to_num(values, copy=False)
        # In place, and turned only when the numbers are small: this is the last thing that a drive waits for.
        values /= max(float(values.max()), -float(values.min()), 1e-9)
        values *= 127
        values += 128
        picture: NDArray[np.uint8] = np.rint(values, out=values).astype(np.uint8)
        return np.ascontiguousarray(picture.T)


def _shades(color: tuple[int, int, int]) -> list[tuple[int, int, int]]:
    """A faint and a full shade: two curves that belong together look alike."""
    red, green, blue = color
    return [(red // 2, green // 2, blue // 2), color]
