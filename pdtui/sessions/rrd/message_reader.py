"""Read the messages of an .rrd file, check that they are whole, and go on behind damage if asked."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

import pyarrow as pa

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd import message_decoder as decoder
from pdtui.sessions.rrd import message_framing as framing
from pdtui.sessions.rrd.message_checksum import (
    SEAL_BYTES,
    SEAL_PATTERN,
    compute_message_checksum,
    compute_start_checksum,
    read_message_seal,
)
from pdtui.sessions.rrd.message_framing import RrdMessageSpan

DECODING_ERRORS = (ValueError, OverflowError, EOFError, OSError, MemoryError, pa.ArrowException)
_SEARCHED_FOR_SEALS = 1 << 20
_MAX_CANDIDATES, _SEARCH_FACTOR = 1_000_000, 4
"""Where a file is damaged, so many places are tried, and so many times its size is read at most."""

_SEALED = re.compile(SEAL_PATTERN + rb"[\x00-\x03]\x00{7}", re.DOTALL)


class RrdMessage(NamedTuple):
    """A message and its payload, which is empty for the last message of a file: that one may be long."""

    span: RrdMessageSpan
    payload: memoryview


class DamagedSpan(NamedTuple):
    """Bytes of a file that cannot be read.

    Attributes:
        start, end: first byte, and the byte after the last.
        reason: what is wrong, in words.
    """

    start: int
    end: int
    reason: str


class MessageReader:
    """Iterates over the messages of a file, each of which is checked by its checksum if the file has them.

    Args:
        file: the file, after its start was checked.
        size: its size, bytes.
        damage: a list to which damage is added, behind which reading goes on with the next whole message; by
            default, damage is a `SessionError` that names the byte.

    Attributes:
        sealed: whether the messages have checksums.
        finished: whether the last message was read, and is whole.
        messages: number of messages so far, except the last.
        checksum: checksum of the latest message that has one; before the first, of the start of the file.
    """

    def __init__(self, file: BinaryIO, size: int, damage: list[DamagedSpan] | None = None) -> None:
        self._file, self._size, self._damage = file, size, damage
        file.seek(0)
        head = file.read(_SEARCHED_FOR_SEALS)
        self.sealed = _SEALED.search(head) is not None
        self.finished = False
        self.messages, self.checksum = 0, compute_start_checksum(head[: framing.START_BYTES])
        self._candidates, self._bytes_left = _MAX_CANDIDATES, _SEARCH_FACTOR * size
        self._chain_known = True

    def __iter__(self) -> Iterator[RrdMessage]:
        place = framing.START_BYTES
        while place < self._size:
            try:
                span = framing.read_message_span(self._file, place, self._size)
                payload = self._read_payload(span)
                self._check_whole(span, payload)
            except SessionError as error:
                if self._damage is None:
                    raise
                place = self._skip_damage(place, _reason(error))
                continue
            self._check_chain(span, payload)
            self._chain_known = True
            if span.kind == framing.LAST:
                self.finished = True
            else:
                self.messages += 1
            yield RrdMessage(span, payload)
            place = span.end

    def _read_payload(self, span: RrdMessageSpan) -> memoryview:
        if span.kind == framing.LAST:
            framing.check_rrd_end(self._file, span)
            return memoryview(b"")
        return read_payload(self._file, span)

    def _check_whole(self, span: RrdMessageSpan, payload: memoryview) -> None:
        """Check a message by its checksum; without one, if damage is to be skipped, by decoding it."""
        if span.kind == framing.LAST:
            return
        if not self.sealed:
            if self._damage is not None:
                decode_message(span, payload)
            return
        seal = read_message_seal(payload)
        if seal is None:
            raise SessionError(f"byte {span.begin}: the message has no checksum, though the others have")
        content = payload[:-SEAL_BYTES]
        if compute_message_checksum(span.kind, span.length, content, seal.link) != seal.checksum:
            raise SessionError(f"byte {span.begin}: the message does not match its checksum")

    def _check_chain(self, span: RrdMessageSpan, payload: memoryview) -> None:
        seal = read_message_seal(payload) if self.sealed else None
        if seal is None:
            return
        broken = self._chain_known and seal.link != self.checksum & 0xFFFFFFFF
        self.checksum = seal.checksum
        if broken:
            why = "messages are missing before this one, or are not where they were written"
            if self._damage is None:
                raise SessionError(f"byte {span.begin}: {why}")
            self._damage.append(DamagedSpan(span.begin, span.begin, why))

    def _skip_damage(self, place: int, reason: str) -> int:
        """Note the damage at a byte and return where the next whole message begins, or the file ends."""
        assert self._damage is not None
        following = self._size
        for span in framing.find_span_candidates(self._file, place + 1, self._size):
            self._candidates -= 1
            if self._candidates < 0 or self._bytes_left < 0:
                break
            if span.begin > place and self._is_whole(span):
                following = span.begin
                break
        self._damage.append(DamagedSpan(place, following, reason))
        self._chain_known = False
        return following

    def _is_whole(self, span: RrdMessageSpan) -> bool:
        if self.sealed and span.kind != framing.LAST:
            if span.length < SEAL_BYTES:
                return False
            self._file.seek(span.end - SEAL_BYTES)
            if read_message_seal(self._file.read(SEAL_BYTES)) is None:
                return False
        self._bytes_left -= span.length
        try:
            self._check_whole(span, self._read_payload(span))
        except SessionError:
            return False
        return True


def read_payload(file: BinaryIO, span: RrdMessageSpan) -> memoryview:
    """Read the payload of a message; one that is too long, or no longer there, is a `SessionError`."""
    if span.length > decoder.MAX_MESSAGE:
        most = decoder.MAX_MESSAGE >> 20
        raise SessionError(f"byte {span.begin}: expected a message of at most {most} MiB")
    file.seek(span.start)
    payload = file.read(span.length)
    if len(payload) < span.length:
        raise SessionError("the file was shortened while it was read")
    return memoryview(payload)


def decode_message(
    span: RrdMessageSpan, payload: memoryview
) -> tuple[decoder.RrdStoreInfo, decoder.EntityChunk | None] | None:
    """Return the store of a message, with the rows if it has any; None if it is of another kind.

    A message that is damaged or hostile is a `SessionError`.
    """
    try:
        if span.kind == framing.STORE:
            return decoder.decode_store_info(payload), None
        if span.kind == framing.CHUNK:
            return decoder.decode_chunk(payload)
        return None
    except DECODING_ERRORS as error:
        why = " ".join(str(error).split())[:200]
        raise SessionError(f"byte {span.start}: a message is damaged: {why}") from error


def _reason(error: SessionError) -> str:
    """Return what is wrong without the byte, which the span of the damage names."""
    return re.sub(r"^(the file is torn: )?byte \d+: ", "", str(error))
