"""Draw obstacles in the viewer: cylinders in the 3D view, discs in the view from above."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import NO_OBSTACLES
from pdtui.core.step_record import StepRecord
from pdtui.sessions.session_schema import OBSTACLES, OBSTACLES_ABOVE
from pdtui.sessions.viewer.viewer_curves import LogStatic, SendRows
from pdtui.sessions.writer.arrow_columns import number_list_column, vector_list_column

_COLOR = (92, 138, 84)
_HEIGHT = 1.2
"""Drawn height, m. Obstacles have no height of their own; this one does not hide the robot."""


class ObstacleWriter:
    """Writes the obstacles of a world at its first step; they stay until the next world begins."""

    def __init__(self, send: SendRows, log_static: LogStatic) -> None:
        self._send, self._log_static = send, log_static
        self._present: Floats = NO_OBSTACLES
        self._pending: list[tuple[int, Floats]] = []
        self._styled = False

    def add(self, records: Iterable[StepRecord]) -> None:
        """Add control steps."""
        for record in records:
            if record.obstacles is self._present:
                continue
            if not np.array_equal(record.obstacles, self._present):
                self._pending.append((record.step, record.obstacles))
            self._present = record.obstacles

    def write(self) -> None:
        """Write what was added since the last call."""
        pending, self._pending = self._pending, []
        if pending and not self._styled:
            self._styled = True
            self._log_static(OBSTACLES, rr.Cylinders3D.from_fields(colors=[_COLOR], fill_mode="solid"))
            self._log_static(OBSTACLES_ABOVE, rr.Points2D.from_fields(colors=[_COLOR]))
        for step, obstacles in pending:
            self._write(step, obstacles.astype(np.float32))

    def _write(self, step: int, obstacles: NDArray[np.float32]) -> None:
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
