"""An .rrd file as a stream of chunks; what is wrong with it becomes a `SessionError` that names the byte."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
import pyarrow as pa

from pdtui.core.errors import SessionError
from pdtui.core.untrusted_file import open_regular_file
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.message_decoder import (
    MAX_MESSAGE,
    EntityChunk,
    StoreInfo,
    decode_chunk,
    decode_store_info,
)
from pdtui.sessions.rrd.message_framing import (
    CHUNK,
    LAST,
    RESCUE,
    STORE,
    MessageFrame,
    check_end,
    check_start,
    read_message_frames,
)
from pdtui.sessions.session_schema import APP, DRIVE, STEP, VIEWS

MAX_KEPT = 4 << 30
"""Bytes of rows that are kept in memory: an hour at 50 Hz with 512 units has 0.6 GB."""

T = TypeVar("T")
_PROPERTIES = "/__properties/"
_PROPERTY_TYPES = (pa.utf8(), pa.int64(), pa.float64(), pa.bool_())
_MAX_STORES = 16
_DAMAGED = (ValueError, OverflowError, EOFError, OSError, MemoryError, pa.ArrowException)


class RrdContents:
    """An .rrd of pdtui, read once from its beginning to its end.

    Every message is decoded and checked, also those that are not kept.

    Args:
        path: the file.
        only: components of the drive to keep; all if empty.
        skip: components of the drive to leave out.
        torn: read up to the first message that cannot be read, instead of raising.

    Attributes:
        recording_id: of the recording.
        complete: whether every message could be read.
        finished: whether it is complete and ends as a finished one does, with an index of its chunks.

    Raises:
        SessionError: no such file, not a recording, another program's, or torn.
    """

    def __init__(
        self, path: Path, *, only: Sequence[str] = (), skip: Sequence[str] = (), torn: bool = False
    ) -> None:
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self._properties: dict[str, dict[str, list[Any]]] = {}
        self._kept = 0
        stream = ChunkStream(path)
        try:
            for chunk in stream:
                self._take(path, chunk, only, skip)
        except SessionError:
            if not torn or stream.store is None:
                raise
        self.recording_id = stream.found().recording_id
        self.complete, self.finished = stream.complete, stream.finished

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


class ChunkStream:
    """The chunks of a recording in the order of the file; never more than one is in memory.

    Attributes:
        store: of the recording, once its announcement was read.
        complete: whether every message was read.
        finished: whether the index at the file's end was, too.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stores: list[StoreInfo] = []
        self.store: StoreInfo | None = None
        self.complete = self.finished = False

    def __iter__(self) -> Iterator[EntityChunk]:
        """Read from the beginning.

        Raises:
            SessionError: no such file, not a recording, another program's, or torn: raised after the chunks
                before the damage were given. The message names file and byte.
        """
        try:
            with open_regular_file(self._path) as file:
                yield from self._chunks(file)
        except FileNotFoundError:
            raise SessionError(f"{self._path}: no such file") from None
        except OSError as error:
            raise SessionError(f"{self._path}: cannot be read: {error.strerror}") from error
        except SessionError as error:
            raise SessionError(f"{self._path}: {error}") from error
        self.found()
        self.complete = True

    def found(self) -> StoreInfo:
        """The store of the recording.

        Raises:
            SessionError: the file announces none.
        """
        if self.store is None:
            raise SessionError(f"{self._path}: holds no recording")
        return self.store

    def _chunks(self, file: BinaryIO) -> Iterator[EntityChunk]:
        check_start(file)
        for frame in read_message_frames(file, os.fstat(file.fileno()).st_size):
            if frame.kind == LAST:
                check_end(file, frame)
                self.finished = True
            elif frame.kind == STORE:
                self._announced(_decoded(file, frame, decode_store_info))
            elif frame.kind == CHUNK:
                store, chunk = _decoded(file, frame, decode_chunk)
                if store not in self._stores:
                    raise SessionError(
                        f"byte {frame.start}: rows of a recording that the file does not announce"
                    )
                if store == self.store:
                    yield chunk

    def _announced(self, store: StoreInfo) -> None:
        if store in self._stores:
            return
        if len(self._stores) == _MAX_STORES:
            raise SessionError(f"expected at most {_MAX_STORES} recordings and layouts, there are more")
        if store.application_id != APP:
            raise SessionError(f"expected a recording of {APP}, found one of '{store.application_id[:60]}'")
        self._stores.append(store)
        if self.store is None and store.drive:
            self.store = store


def _decoded(file: BinaryIO, frame: MessageFrame, read: Callable[[memoryview], T]) -> T:
    """What a message says.

    Raises:
        SessionError: it is damaged or too large.
    """
    if frame.length > MAX_MESSAGE:
        raise SessionError(f"byte {frame.start}: expected a message of at most {MAX_MESSAGE >> 20} MiB")
    file.seek(frame.start)
    payload = file.read(frame.length)
    if len(payload) < frame.length:
        raise SessionError("the file became shorter while it was read")
    try:
        return read(memoryview(payload))
    except _DAMAGED as error:
        why = " ".join(str(error).split())[:200]
        raise SessionError(f"byte {frame.start}: a message is damaged: {why}; {RESCUE}") from error
