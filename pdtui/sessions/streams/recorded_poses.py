"""The recorded poses of the robot's shapes, which come later in the file than the control steps."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.session_schema import ROBOT, STEP
from pdtui.sessions.viewer.link_shape_poses import VECTOR_LENGTHS, box_links, round_links

Poses = dict[str, NDArray[np.float32]]


class RecordedPoses:
    """Keeps poses that were read until their control steps are taken.

    Args:
        header: the header of the session.
    """

    def __init__(self, header: SessionHeader) -> None:
        self._path, self._gaps, links = header.path, header.gaps, header.info.links
        self._shapes = {"Capsules3D": len(round_links(links)), "Boxes3D": len(box_links(links))}
        self._batches: list[pa.RecordBatch] = []
        self._newest = self._taken = -1
        self._gathered = False

    def add(self, batch: pa.RecordBatch) -> None:
        """Add rows in the order of the file."""
        if self._gathered or not batch.num_rows:
            return
        batch = _select_columns(batch)
        steps = EntityTable(ROBOT, [batch]).steps
        self._batches.append(self._drop_gaps(batch))
        self._newest = int(steps[-1])
        if steps[0] <= self._taken:
            raise SessionError(f"the poses of step {steps[0]} come too late in the file")

    def gather(self) -> None:
        """Read all poses that were not taken yet from the file, which has them in another order."""
        found, self._batches = ChunkStream(self._path, lambda entity: entity == ROBOT), []
        for chunk in found:
            if STEP in chunk.timelines and chunk.entity == ROBOT and chunk.batch.num_rows:
                batch = _select_columns(chunk.batch)
                EntityTable(ROBOT, [batch])  # checks the numbers of the steps
                later = batch.filter(pc.greater(batch.column(STEP), self._taken))
                self._batches.append(self._drop_gaps(later))
        self._gathered = True

    def take(self, first: int, last: int, *, at_end: bool) -> tuple[NDArray[np.int64], Poses]:
        """Take the poses of the control steps from `first` to `last`.

        Returns:
            The steps that have poses, shape (p,), and the poses as in `StepBlock.poses`.
        """
        if not (at_end or self._gathered or self._newest >= last):
            self.gather()
        due, rest = [], []
        for batch in self._batches:
            now = pc.less_equal(batch.column(STEP), last)
            due.append(batch.filter(now))
            rest.append(batch.filter(pc.invert(now)))
        table = EntityTable(ROBOT, due)
        self._batches, self._taken = [batch for batch in rest if batch.num_rows], last
        if len(table.steps) and table.steps[0] < first:
            raise SessionError(f"poses of step {table.steps[0]}, which is not recorded")
        if not len(table.steps):
            return table.steps, {}
        return table.steps, {
            name: table.read_vectors(name, length, width)
            for name, length in VECTOR_LENGTHS.items()
            if (width := self._shapes[name.partition(":")[0]])
        }

    def require_all_poses_taken(self) -> None:
        """Check that all poses were taken; those of steps beyond the last are a `SessionError`."""
        for batch in self._batches:
            if batch.num_rows:
                raise SessionError(f"poses of step {batch.column(STEP)[0]}, which is not recorded")

    def _drop_gaps(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Leave out the poses of steps that a repair could not rescue, of which only the poses survive."""
        for first, end in self._gaps:
            steps = batch.column(STEP)
            batch = batch.filter(pc.or_(pc.less(steps, first), pc.greater_equal(steps, end)))
        return batch


def _select_columns(batch: pa.RecordBatch) -> pa.RecordBatch:
    places = {name: place for place, name in enumerate(batch.schema.names)}
    return batch.select([places[name] for name in (STEP, *VECTOR_LENGTHS) if name in places])
