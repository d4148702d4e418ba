"""The contents of an .rrd file of pdtui: its properties and the rows of its entities."""

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
from pdtui.sessions.rrd.message_reader import DamagedSpan
from pdtui.sessions.session_schema import DRIVE, STEP, VIEWS

MAX_KEPT = 4 << 30
"""Largest size of the rows kept in memory, bytes. An hour at 50 Hz with 512 units takes 0.6 GB."""

PROPERTIES = "/__properties/"
_PROPERTY_TYPES = (pa.utf8(), pa.int64(), pa.float64(), pa.bool_())


class RrdContents:
    """The properties and rows of an .rrd file of pdtui, which is read once from beginning to end.

    Args:
        path: the file.
        entities: the entities whose rows are kept, besides all properties; the rows of the others are
            counted but not decoded. By default every message is decoded and checked, and all rows are kept
            except those that only the viewer draws.
        only, skip: columns of the drive to keep, all if empty, and columns to leave out.
        damage: a list to which damage is added instead of raising an error; what is whole behind it is read.

    Attributes:
        recording_id: the identifier of the recording.
        finished: whether the file ends with the index of its chunks, as a finished recording does.
        skipped_rows: number of rows by entity that were counted but not decoded.
        sealed: whether the messages have checksums.

    Raises:
        SessionError: the file does not exist, is no recording of pdtui, or is damaged.
    """

    def __init__(
        self,
        path: Path,
        *,
        entities: Sequence[str] = (),
        only: Sequence[str] = (),
        skip: Sequence[str] = (),
        damage: list[DamagedSpan] | None = None,
    ) -> None:
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self._properties: dict[str, dict[str, list[Any]]] = {}
        self._kept = 0

        def needed(entity: str) -> bool:
            return entity in entities or entity.startswith(PROPERTIES)

        stream = ChunkStream(path, needed if entities else None, damage=damage)
        for chunk in stream:
            self._keep_chunk(path, chunk, only, skip)
        self.recording_id = stream.require_store().recording_id
        self.finished, self.skipped_rows = stream.finished, stream.skipped_rows
        self.sealed = stream.sealed

    def properties(self, name: str) -> dict[str, list[Any]]:
        """Return the values of a group of properties by name; empty if the file does not have the group."""
        return self._properties.get(name, {})

    def table(self, entity: str) -> EntityTable:
        """Return the rows of an entity; no rows if the file does not have the entity."""
        return EntityTable(entity, self._batches.get(entity, []))

    def _keep_chunk(self, path: Path, chunk: EntityChunk, only: Sequence[str], skip: Sequence[str]) -> None:
        entity, batch = chunk.entity, chunk.batch
        if entity.startswith(PROPERTIES):
            group = self._properties.setdefault(entity.removeprefix(PROPERTIES), {})
            for name, column in zip(batch.schema.names, batch.columns, strict=True):
                known = pa.types.is_list(column.type) and column.type.value_type in _PROPERTY_TYPES
                if known and len(column) and column[-1].is_valid:
                    group[name] = column[-1].as_py()
        elif chunk.timelines and not entity.startswith(VIEWS):
            if entity == DRIVE:
                names = [name for name in batch.schema.names if name not in skip]
                batch = batch.select([name for name in names if not only or name in (STEP, *only)])
                # A copy: a view would keep the whole message in memory, and with it the other columns.
                batch = batch.take(pa.array(np.arange(batch.num_rows)))
            self._kept += batch.nbytes
            if self._kept > MAX_KEPT:
                raise SessionError(f"{path}: expected at most {MAX_KEPT >> 20} MiB of rows, found more")
            self._batches.setdefault(entity, []).append(batch)
