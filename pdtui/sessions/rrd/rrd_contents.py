"""What an .rrd file of pdtui contains: its properties, and the rows of its entities."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.message_decoder import EntityChunk
from pdtui.sessions.session_schema import DRIVE, STEP, VIEWS

MAX_KEPT = 4 << 30
"""Bytes of rows that are kept in memory: an hour at 50 Hz with 512 units has 0.6 GB."""

_PROPERTIES = "/__properties/"
_PROPERTY_TYPES = (pa.utf8(), pa.int64(), pa.float64(), pa.bool_())


class RrdContents:
    """An .rrd of pdtui, read once from its beginning to its end.

    Args:
        path: the file.
        entities: whose rows are kept, besides all properties; the rows of others are counted, not decoded. By
            default every message is decoded and checked, and all rows but the viewer's are kept.
        only: components of the drive to keep; all if empty.
        skip: components of the drive to leave out.
        torn: read up to the first message that cannot be read, instead of raising.

    Attributes:
        skipped_rows: number of rows by entity that were counted only.
        recording_id: of the recording.
        complete: whether every message could be read.
        finished: whether it is complete and ends as a finished one does, with an index of its chunks.

    Raises:
        SessionError: no such file, not a recording, another program's, or torn.
    """

    def __init__(
        self,
        path: Path,
        *,
        entities: Sequence[str] = (),
        only: Sequence[str] = (),
        skip: Sequence[str] = (),
        torn: bool = False,
    ) -> None:
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self._properties: dict[str, dict[str, list[Any]]] = {}
        self._kept = 0

        def needed(entity: str) -> bool:
            return entity in entities or entity.startswith(_PROPERTIES)

        stream = ChunkStream(path, needed if entities else None)
        try:
            for chunk in stream:
                self._take(path, chunk, only, skip)
        except SessionError:
            if not torn or stream.store is None:
                raise
        self.recording_id = stream.found().recording_id
        self.complete, self.finished = stream.complete, stream.finished
        self.skipped_rows = stream.skipped_rows

    def properties(self, name: str) -> dict[str, list[Any]]:
        """Values of one group of properties, by name; empty if the file has none."""
        return self._properties.get(name, {})

    def rows(self, entity: str) -> EntityTable:
        """All rows of an entity; none if the file has none."""
        return EntityTable(entity, self._batches.get(entity, []))

    def _take(self, path: Path, chunk: EntityChunk, only: Sequence[str], skip: Sequence[str]) -> None:
        entity, batch = chunk.entity, chunk.batch
        if entity.startswith(_PROPERTIES):
            group = self._properties.setdefault(entity.removeprefix(_PROPERTIES), {})
            for name, column in zip(batch.schema.names, batch.columns, strict=True):
                known = pa.types.is_list(column.type) and column.type.value_type in _PROPERTY_TYPES
                if known and len(column) and column[-1].is_valid:
                    group[name] = column[-1].as_py()
        elif chunk.timelines and not entity.startswith(VIEWS):
            if entity == DRIVE:
                names = [name for name in batch.schema.names if name not in skip]
                batch = batch.select([name for name in names if not only or name in (STEP, *only)])
                # A copy, or what is kept would keep the whole message, activations and all, in memory.
                batch = batch.take(pa.array(np.arange(batch.num_rows)))
            self._kept += batch.nbytes
            if self._kept > MAX_KEPT:
                raise SessionError(f"{path}: expected at most {MAX_KEPT >> 20} MiB of rows, there are more")
            self._batches.setdefault(entity, []).append(batch)
