"""What only the viewer needs: robot, path, stimulated units, controllers, behaviors and a heat map.

All of it follows from the rows of the drive, so it is written in larger batches: a crash that loses the last
of it loses no fact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from pdtui.policies.units import format_unit
from pdtui.robots.base import Floats
from pdtui.sessions.columns import Column, rows, texts, vectors
from pdtui.sessions.record import DriveInfo, StepRecord
from pdtui.sessions.schema import BEHAVIORS, CONTROLLERS, HEAT_MAP, PATH, ROBOT, UNITS
from pdtui.sessions.shapes import Shapes

Send = Callable[[str, Sequence[int], list[Column]], None]
LogStatic = Callable[[str, Any], None]

_IDLE = (150, 150, 150)
PALETTE = (
    (230, 159, 0),
    (86, 180, 233),
    (0, 158, 115),
    (204, 121, 167),
    (240, 228, 66),
    (0, 114, 178),
    (213, 94, 0),
)
_DRAWN_APART = 0.04
"""Simulated time between two pictures of the robot, s: what the eye needs. Poses are the largest stream after
the activations, and a replay has all of them."""
_HEAT_COLUMNS = 768


class Views:
    """Collects control steps and writes what the viewer draws of them.

    Args:
        info: of robot and policy.
        send: writes a batch of rows.
        log_static: writes what holds at all times.
    """

    def __init__(self, info: DriveInfo, send: Send, log_static: LogStatic) -> None:
        self._layers, self._send, self._log_static = info.layers, send, log_static
        self._shapes = Shapes(info.links)
        self._draw_every = max(1, round(_DRAWN_APART / info.dt))
        for part in self._shapes.static():
            log_static(ROBOT, part)
        self._units = _Lines(UNITS, ("natural", "overwritten"), send, log_static)
        self._controllers = _Lines(CONTROLLERS, ("target", "value", "error", "c"), send, log_static)
        self._colors: dict[str, tuple[int, int, int]] = {}
        self._state = ""
        self._pending = 0
        self._changes: list[tuple[int, str]] = []
        self._drawn: list[tuple[int, Floats, str]] = []
        self._heat = _HeatMap()

    def add(self, records: Sequence[StepRecord]) -> None:
        """Take in control steps."""
        self._pending += len(records)
        for record in records:
            state = " + ".join(behavior.name for behavior in record.behaviors)
            if state != self._state:
                self._changes.append((record.step, state))
                self._state = state
            if record.step % self._draw_every == 0:
                self._drawn.append((record.step, record.poses, state))
            values = zip(record.natural, record.stimulation.values, strict=True)
            units = zip(record.stimulation.units, values, strict=True)
            self._units.add(record.step, {format_unit(unit, self._layers): pair for unit, pair in units})
            self._controllers.add(
                record.step,
                {
                    one.name: (one.target, one.value, one.error, one.magnitude)
                    for one in record.behaviors
                    if one.target is not None
                },
            )
            self._heat.add(record.step, record.activations)

    @property
    def pending(self) -> int:
        """Control steps that are not written yet."""
        return self._pending

    def write(self) -> None:
        """Write what was collected since the last time."""
        if self._drawn:
            self._name_states()
            steps, poses, states = zip(*self._drawn, strict=True)
            self._write_robot(steps, np.stack(poses), states)
            self._drawn = []
        self._pending = 0
        self._units.write()
        self._controllers.write()

    def write_changes(self) -> None:
        """Write at which steps other behaviors became active."""
        if self._changes:
            self._name_states()
            steps, states = zip(*self._changes, strict=True)
            self._send(BEHAVIORS, steps, [texts(rr.StateChange.descriptor_state(), states)])
            self._changes = []

    def finish(self) -> None:
        """Write what can only be drawn at the end."""
        self.write_changes()
        self.write()
        picture = self._heat.picture()
        if picture is not None:
            self._log_static(HEAT_MAP, rr.Tensor(picture, dim_names=("unit", "time")))

    def _write_robot(self, steps: Sequence[int], poses: Floats, states: Sequence[str]) -> None:
        self._send(ROBOT, steps, self._shapes.columns(poses))
        positions = np.zeros((len(steps), 1, 3), np.float32)
        positions[:, 0, :2] = poses[:, 0, :2]
        # A picture's y axis points down, and only in a picture does the viewer fit the path to the frame.
        above = positions[:, :, :2] * np.array([1.0, -1.0], np.float32)
        colors = np.array([_packed(self._colors.get(state, _IDLE)) for state in states], np.uint32)
        columns = [
            vectors(rr.Points3D.descriptor_positions(), positions),
            rows(rr.Points3D.descriptor_colors(), colors),
            vectors(rr.Points2D.descriptor_positions(), above),
            rows(rr.Points2D.descriptor_colors(), colors),
        ]
        self._send(PATH, steps, columns)

    def _name_states(self) -> None:
        states = {state for _, state in self._changes if state} - self._colors.keys()
        if not states:
            return
        for _, state in self._changes:
            if state in states and state not in self._colors:
                self._colors[state] = PALETTE[len(self._colors) % len(PALETTE)]
        self._log_static(
            BEHAVIORS,
            rr.StateConfiguration(values=list(self._colors), colors=list(self._colors.values())),
        )


class _Lines:
    """Curves that come and go: one entity for each name, one curve for each field."""

    def __init__(self, entity: str, fields: tuple[str, ...], send: Send, log_static: LogStatic) -> None:
        self._entity, self._fields, self._send, self._log_static = entity, fields, send, log_static
        self._rows: dict[str, list[tuple[int, tuple[Any, ...]]]] = {}
        self._last: tuple[str, ...] = ()

    def add(self, step: int, values: dict[str, tuple[Any, ...]]) -> None:
        for name in self._last:
            if name not in values:
                # A gap, or the viewer would draw a line to where the curve comes back.
                self._rows[name].append((step, (math.nan,) * len(self._fields)))
        for name, row in values.items():
            if name not in self._rows:
                self._rows[name] = []
                names = [f"{name} {field}" for field in self._fields]
                pair = _shades(PALETTE[len(self._rows) % len(PALETTE)])
                colors = pair if len(names) == len(pair) else list(PALETTE[: len(names)])
                self._log_static(self._path_of(name), rr.SeriesLines(names=names, colors=colors))
            self._rows[name].append((step, row))
        self._last = tuple(values)

    def write(self) -> None:
        for name, buffered in self._rows.items():
            if buffered:
                steps, values = zip(*buffered, strict=True)
                block = np.array(values, np.float64)
                self._send(self._path_of(name), steps, [rows(rr.Scalars.descriptor_scalars(), block)])
                self._rows[name] = []

    def _path_of(self, name: str) -> str:
        return f"{self._entity}/{rr.escape_entity_path_part(name)}"


class _HeatMap:
    """All activations over the whole session, thinned out as it grows."""

    def __init__(self) -> None:
        self._stride = 1
        self._columns: list[NDArray[np.float32]] = []

    def add(self, step: int, activations: NDArray[np.float32]) -> None:
        if step % self._stride == 0:
            self._columns.append(activations)
            if len(self._columns) > _HEAT_COLUMNS:
                self._columns = self._columns[::2]
                self._stride *= 2

    def picture(self) -> NDArray[np.uint8] | None:
        """Units from top to bottom, time from left to right; 128 is zero, the largest magnitude 1 or 255."""
        if not self._columns:
            return None
        values = np.nan_to_num(np.stack(self._columns, axis=1))
        share = np.clip(values / max(float(np.abs(values).max()), 1e-9), -1.0, 1.0)
        picture: NDArray[np.uint8] = np.rint(128 + 127 * share).astype(np.uint8)
        return picture


def _shades(color: tuple[int, int, int]) -> list[tuple[int, int, int]]:
    """A faint and a full shade: two curves that belong together look alike."""
    red, green, blue = color
    return [(red // 2, green // 2, blue // 2), color]


def _packed(color: tuple[int, int, int]) -> int:
    red, green, blue = color
    return red << 24 | green << 16 | blue << 8 | 255
