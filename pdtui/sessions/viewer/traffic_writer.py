"""Draw traffic in the viewer: one entity per box, which appears, moves and vanishes."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, sin

import numpy as np
import pyarrow as pa
import rerun as rr

from pdtui.core.scenery import NO_TRAFFIC, BoxKind, Traffic
from pdtui.core.step_record import StepRecord
from pdtui.sessions.session_schema import TRAFFIC
from pdtui.sessions.viewer.viewer_curves import SendRows, pack_color
from pdtui.sessions.writer.arrow_columns import ragged_list_column, ragged_vector_column, vector_list_column

_COLORS: dict[BoxKind, tuple[int, int, int]] = {"vehicle": (205, 176, 92), "obstacle": (92, 138, 84)}
_MOVED = 1e-3
"""Least change of a coordinate (m) or of the yaw (rad) that is written: what rests jitters a little."""

BoxKey = tuple[BoxKind, int]
Pose = list[float]
Size = list[float]


class TrafficWriter:
    """Writes poses of boxes where they changed, and sizes where a box appears; where it vanishes, no size.

    Args:
        draw_every: control steps from one pose to the next that may be written.
        send: writes a batch of rows.
    """

    def __init__(self, draw_every: int, send: SendRows) -> None:
        self._draw_every, self._send = draw_every, send
        self._present: dict[BoxKey, tuple[Pose, Size]] = {}
        self._poses: dict[BoxKey, list[tuple[int, Pose]]] = {}
        self._sizes: dict[BoxKey, list[tuple[int, Size | None]]] = {}

    def add(self, records: Iterable[StepRecord]) -> None:
        """Add control steps."""
        for record in records:
            if record.traffic is not NO_TRAFFIC or self._present:
                self._add_step(record.step, record.traffic)

    def _add_step(self, step: int, traffic: Traffic) -> None:
        drawn = step % self._draw_every == 0
        boxes = zip(traffic.keys, traffic.poses.tolist(), traffic.sizes.tolist(), strict=True)
        gone = set(self._present)
        for key, pose, size in boxes:
            gone.discard(key)
            old_pose, old_size = self._present.get(key, (None, None))
            if size != old_size:
                self._sizes.setdefault(key, []).append((step, size))
            if old_pose is None or (drawn and _has_moved(pose, old_pose)):
                self._poses.setdefault(key, []).append((step, pose))
                old_pose = pose
            self._present[key] = old_pose, size
        for key in gone:
            del self._present[key]
            self._sizes.setdefault(key, []).append((step, None))

    def write(self) -> None:
        """Write what was added since the last call."""
        for key, sizes in self._sizes.items():
            self._write_sizes(key, sizes)
        for key, poses in self._poses.items():
            self._write_poses(key, poses)
        self._sizes, self._poses = {}, {}

    def _write_sizes(self, key: BoxKey, rows: list[tuple[int, Size | None]]) -> None:
        """Write half sizes with the style; a row of a box that has vanished is empty."""
        there = [int(size is not None) for _, size in rows]
        half_sizes = np.array([size for _, size in rows if size is not None], np.float32).reshape(-1, 3) / 2
        color, solid = pack_color(_COLORS[key[0]]), rr.components.FillMode.Solid.value
        columns = [
            ragged_vector_column(rr.Boxes3D.descriptor_half_sizes(), half_sizes, there),
            ragged_list_column(rr.Boxes3D.descriptor_colors(), [[color] * one for one in there], pa.uint32()),
            ragged_list_column(
                rr.Boxes3D.descriptor_fill_mode(), [[solid] * one for one in there], pa.uint8()
            ),
        ]
        self._send(_entity_of(key), [step for step, _ in rows], columns)

    def _write_poses(self, key: BoxKey, rows: list[tuple[int, Pose]]) -> None:
        centers = np.array([[pose[:3]] for _, pose in rows], np.float32)
        turns = [[[0.0, 0.0, sin(pose[3] / 2), cos(pose[3] / 2)]] for _, pose in rows]
        columns = [
            vector_list_column(rr.Boxes3D.descriptor_centers(), centers),
            vector_list_column(rr.Boxes3D.descriptor_quaternions(), np.array(turns, np.float32)),
        ]
        self._send(_entity_of(key), [step for step, _ in rows], columns)


def _has_moved(pose: Pose, before: Pose) -> bool:
    return any(abs(one - other) > _MOVED for one, other in zip(pose, before, strict=True))


def _entity_of(key: BoxKey) -> str:
    kind, identity = key
    return f"{TRAFFIC}/{kind}_{identity}"
