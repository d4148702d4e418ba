"""The chunks of an .rrd file, one after the other; an error names the byte at which the file is damaged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd import message_framing as framing
from pdtui.sessions.rrd.message_decoder import EntityChunk, RrdStoreInfo, read_chunk_head
from pdtui.sessions.rrd.message_framing import RrdMessageSpan, open_rrd_file
from pdtui.sessions.rrd.message_reader import (
    DamagedSpan,
    MessageReader,
    RrdMessage,
    decode_message,
    read_payload,
)
from pdtui.sessions.session_schema import APP, is_session_application_id

RESCUE = "`pdtui sessions repair` rescues what is whole"
_MAX_STORES = 16


class ChunkStream:
    """Iterates over the chunks of a recording in file order, with one chunk in memory at a time.

    Args:
        path: the file.
        needed: tells by its entity whether a chunk is decoded; of the others only the heads are read, and
            no checksum is. By default every message is checked and decoded.
        damage: a list to which damage is added instead of raising an error; what is whole behind it is read.

    Attributes:
        store: the store of the recording, once a message has named it.
        finished: whether the index at the end of the file was read, too.
        skipped_rows: number of rows by entity in the chunks that were not decoded.
        sealed: whether the messages have checksums; False if only heads are read.
        size: size of the file, bytes.
    """

    def __init__(
        self,
        path: Path,
        needed: Callable[[str], bool] | None = None,
        *,
        damage: list[DamagedSpan] | None = None,
    ) -> None:
        self._path, self._needed, self._damage = path, needed, damage
        self._stores: list[RrdStoreInfo] = []
        self.store: RrdStoreInfo | None = None
        self.finished = self.sealed = False
        self.skipped_rows: Counter[str] = Counter()
        self.size = 0

    def __iter__(self) -> Iterator[EntityChunk]:
        """Read the file from its beginning; the chunks before any damage are yielded first.

        Raises:
            SessionError: the file does not exist, is no recording of pdtui, or is damaged, and at which byte.
        """
        with open_rrd_file(self._path) as (file, self.size):
            try:
                yield from self._chunks(file)
            except SessionError as error:
                hint = f"; {RESCUE}" if self.store is not None and "byte " in str(error) else ""
                raise SessionError(f"{self._path}: {error}{hint}") from error
        self.require_store()

    def require_store(self) -> RrdStoreInfo:
        """Return the store of the recording; a file that announces none is a `SessionError`."""
        if self.store is None:
            why = self._damage[0].reason if self._damage else "contains no recording"
            raise SessionError(f"{self._path}: {why}")
        return self.store

    def _chunks(self, file: BinaryIO) -> Iterator[EntityChunk]:
        self._check_start(file)
        if self._needed is not None:
            yield from self._chunks_by_head(file, self._needed)
            return
        reader = MessageReader(file, self.size, self._damage)
        self.sealed = reader.sealed
        for message in reader:
            chunk = self._decode(message)
            if chunk is not None:
                yield chunk
        self.finished = reader.finished

    def _check_start(self, file: BinaryIO) -> None:
        try:
            framing.check_rrd_start(file)
        except SessionError as error:
            if self._damage is None:
                raise
            self._damage.append(DamagedSpan(0, framing.START_BYTES, str(error)))

    def _chunks_by_head(self, file: BinaryIO, needed: Callable[[str], bool]) -> Iterator[EntityChunk]:
        for span in framing.read_message_spans(file, self.size):
            if span.kind == framing.LAST:
                framing.check_rrd_end(file, span)
                self.finished = True
                continue
            head = read_chunk_head(file, span, self.store) if span.kind == framing.CHUNK else None
            if head is not None and not (head.store == self.store and needed(head.entity)):
                self._check_announced(head.store, span)
                self.skipped_rows[head.entity] += head.rows
                continue
            chunk = self._decode(RrdMessage(span, read_payload(file, span)))
            if chunk is not None:
                yield chunk

    def _decode(self, message: RrdMessage) -> EntityChunk | None:
        try:
            decoded = decode_message(*message)
            if decoded is None:
                return None
            store, chunk = decoded
            if chunk is None:
                self._add_store(store)
            else:
                self._check_announced(store, message.span)
            return chunk if store == self.store else None
        except SessionError as error:
            if self._damage is None:
                raise
            span = message.span
            self._damage.append(DamagedSpan(span.begin, span.end, str(error)))
            return None

    def _check_announced(self, store: RrdStoreInfo, span: RrdMessageSpan) -> None:
        if store in self._stores:
            return
        if self._damage is None:
            raise SessionError(f"byte {span.start}: rows of a recording that the file does not announce")
        self._add_store(store)  # the message that announced it may be the one that is damaged

    def _add_store(self, store: RrdStoreInfo) -> None:
        if store in self._stores:
            return
        if len(self._stores) == _MAX_STORES:
            raise SessionError(f"expected at most {_MAX_STORES} recordings and blueprints, found more")
        if not is_session_application_id(store.application_id):
            raise SessionError(f"expected a recording of {APP}, found one of '{store.application_id[:60]}'")
        self._stores.append(store)
        if self.store is None and store.is_recording:
            self.store = store
