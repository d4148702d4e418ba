"""Draw scenery in the viewer: lines of roads, cylinders, and discs of these in the view from above."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.scenery import NO_SCENERY, LineKind, RoadLine, Scenery
from pdtui.core.step_record import StepRecord
from pdtui.sessions.session_schema import OBSTACLES, OBSTACLES_ABOVE, ROAD_LINES
from pdtui.sessions.viewer.viewer_curves import LogStatic, SendRows, pack_color
from pdtui.sessions.writer.arrow_columns import number_list_column, polylines_column, vector_list_column

_COLOR = (92, 138, 84)
_HEIGHT = 1.2
"""Drawn height, m. Obstacles have no height of their own; this one does not hide the robot."""
_LINES: dict[LineKind, tuple[tuple[int, int, int], float]] = {
    "solid lane line": ((190, 198, 208), 0.08),
    "broken lane line": ((190, 198, 208), 0.08),
    "road edge": ((128, 136, 148), 0.16),
    "route": ((62, 112, 150), 0.08),
}
"""Color and radius (m) of lines."""


class SceneryWriter:
    """Writes the scenery of a world at its first step; it stays until the next world begins."""

    def __init__(self, send: SendRows, log_static: LogStatic) -> None:
        self._send, self._log_static = send, log_static
        self._present: Scenery = NO_SCENERY
        self._cylinders: list[tuple[int, Floats]] = []
        self._lines: list[tuple[int, tuple[RoadLine, ...]]] = []
        self._styled = False

    def add(self, records: Iterable[StepRecord]) -> None:
        """Add control steps."""
        for record in records:
            old, new = self._present, record.scenery
            if new is old:
                continue
            if not np.array_equal(new.cylinders, old.cylinders):
                self._cylinders.append((record.step, new.cylinders))
            if not _same_lines(new.lines, old.lines):
                self._lines.append((record.step, new.lines))
            self._present = new

    def write(self) -> None:
        """Write what was added since the last call."""
        cylinders, self._cylinders = self._cylinders, []
        lines, self._lines = self._lines, []
        if cylinders and not self._styled:
            self._styled = True
            self._log_static(OBSTACLES, rr.Cylinders3D.from_fields(colors=[_COLOR], fill_mode="solid"))
            self._log_static(OBSTACLES_ABOVE, rr.Points2D.from_fields(colors=[_COLOR]))
        for step, obstacles in cylinders:
            self._write_cylinders(step, obstacles.astype(np.float32))
        for step, road in lines:
            self._write_lines(step, road)

    def _write_cylinders(self, step: int, obstacles: NDArray[np.float32]) -> None:
        count = len(obstacles)
        radii = obstacles[None, :, 2]
        centers = np.full((1, count, 3), _HEIGHT / 2, np.float32)
        centers[0, :, :2] = obstacles[:, :2]
        # As with the path, the y axis of a 2D view points down.
        above = centers[:, :, :2] * np.array([1.0, -1.0], np.float32)
        cylinders = [
            vector_list_column(rr.Cylinders3D.descriptor_centers(), centers),
            number_list_column(rr.Cylinders3D.descriptor_radii(), radii),
            number_list_column(rr.Cylinders3D.descriptor_lengths(), np.full((1, count), _HEIGHT, np.float32)),
        ]
        discs = [
            vector_list_column(rr.Points2D.descriptor_positions(), above),
            number_list_column(rr.Points2D.descriptor_radii(), radii),
        ]
        self._send(OBSTACLES, [step], cylinders)
        self._send(OBSTACLES_ABOVE, [step], discs)

    def _write_lines(self, step: int, lines: tuple[RoadLine, ...]) -> None:
        strips: list[NDArray[np.float32]] = []
        colors, radii = [], []
        for line in lines:
            color, radius = _LINES[line.kind]
            for piece in line.painted_pieces():
                strips.append(piece.astype(np.float32))
                colors.append(pack_color(color))
                radii.append(radius)
        columns = [
            polylines_column(rr.LineStrips3D.descriptor_strips(), strips),
            number_list_column(rr.LineStrips3D.descriptor_colors(), np.array([colors], np.uint32)),
            number_list_column(rr.LineStrips3D.descriptor_radii(), np.array([radii], np.float32)),
        ]
        self._send(ROAD_LINES, [step], columns)


def _same_lines(one: tuple[RoadLine, ...], other: tuple[RoadLine, ...]) -> bool:
    return len(one) == len(other) and all(
        a is b or (a.kind == b.kind and np.array_equal(a.points, b.points))
        for a, b in zip(one, other, strict=True)
    )
