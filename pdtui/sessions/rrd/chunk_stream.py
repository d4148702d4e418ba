"""The chunks of an .rrd file, one after the other; an error names the byte at which the file is damaged."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, TypeVar

import pyarrow as pa

from pdtui.core.errors import SessionError
from pdtui.core.untrusted_file import open_regular_file
from pdtui.sessions.rrd import message_decoder as decoder
from pdtui.sessions.rrd import message_framing as framing
from pdtui.sessions.rrd.message_decoder import EntityChunk, RrdStoreInfo
from pdtui.sessions.rrd.message_framing import RESCUE, RrdMessageSpan
from pdtui.sessions.session_schema import APP

T = TypeVar("T")
_MAX_STORES = 16
_DAMAGED = (ValueError, OverflowError, EOFError, OSError, MemoryError, pa.ArrowException)


class ChunkStream:
    """Iterates over the chunks of a recording in file order, with one chunk in memory at a time.

    Args:
        path: the file.
        needed: tells by its entity whether a chunk is decoded; of the others only the heads are read. By
            default every message is decoded and checked.

    Attributes:
        store: the store of the recording, once the message that announces it was read.
        finished: whether the index at the end of the file was read, too.
        skipped_rows: number of rows by entity in the chunks that were not decoded.
    """

    def __init__(self, path: Path, needed: Callable[[str], bool] | None = None) -> None:
        self._path, self._needed = path, needed
        self._stores: list[RrdStoreInfo] = []
        self.store: RrdStoreInfo | None = None
        self.finished = False
        self.skipped_rows: Counter[str] = Counter()

    def __iter__(self) -> Iterator[EntityChunk]:
        """Read the file from its beginning; the chunks before any damage are yielded first.

        Raises:
            SessionError: the file does not exist, is no recording of pdtui, or is damaged, and at which byte.
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
        self.require_store()

    def require_store(self) -> RrdStoreInfo:
        """Return the store of the recording; a file that announces none is a `SessionError`."""
        if self.store is None:
            raise SessionError(f"{self._path}: contains no recording")
        return self.store

    def _chunks(self, file: BinaryIO) -> Iterator[EntityChunk]:
        framing.check_rrd_start(file)
        for frame in framing.read_message_frames(file, os.fstat(file.fileno()).st_size):
            if frame.kind == framing.LAST:
                framing.check_rrd_end(file, frame)
                self.finished = True
            elif frame.kind == framing.STORE:
                self._add_store(_decode_message(file, frame, decoder.decode_store_info))
            elif frame.kind == framing.CHUNK and (chunk := self._read_chunk(file, frame)) is not None:
                yield chunk

    def _read_chunk(self, file: BinaryIO, frame: RrdMessageSpan) -> EntityChunk | None:
        head = None if self._needed is None else decoder.read_chunk_head(file, frame, self.store)
        if head is None or self._needed is None or (head.store == self.store and self._needed(head.entity)):
            store, chunk = _decode_message(file, frame, decoder.decode_chunk)
        else:
            store, chunk = head.store, None
            self.skipped_rows[head.entity] += head.rows
        if store not in self._stores:
            raise SessionError(f"byte {frame.start}: rows of a recording that the file does not announce")
        return chunk if store == self.store else None

    def _add_store(self, store: RrdStoreInfo) -> None:
        if store in self._stores:
            return
        if len(self._stores) == _MAX_STORES:
            raise SessionError(f"expected at most {_MAX_STORES} recordings and blueprints, found more")
        if store.application_id != APP:
            raise SessionError(f"expected a recording of {APP}, found one of '{store.application_id[:60]}'")
        self._stores.append(store)
        if self.store is None and store.is_recording:
            self.store = store


def _decode_message(file: BinaryIO, frame: RrdMessageSpan, read: Callable[[memoryview], T]) -> T:
    if frame.length > decoder.MAX_MESSAGE:
        raise SessionError(
            f"byte {frame.start}: expected a message of at most {decoder.MAX_MESSAGE >> 20} MiB"
        )
    file.seek(frame.start)
    payload = file.read(frame.length)
    if len(payload) < frame.length:
        raise SessionError("the file was shortened while it was read")
    try:
        return read(memoryview(payload))
    except _DAMAGED as error:
        why = " ".join(str(error).split())[:200]
        raise SessionError(f"byte {frame.start}: a message is damaged: {why}; {RESCUE}") from error
