"""Find the messages of an .rrd file, and find the next whole one where the file is damaged.

A file begins with 12 bytes. Messages follow, each after a header of 16 bytes: its kind and its length. The
last message is of kind 0 and is followed by 32 bytes that contain its position, length and checksum. pdtui's
own recordings have a checksum in every message, too. An error names the byte but not the file.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

from xxhash import xxh32

from pdtui.core.errors import SessionError
from pdtui.core.untrusted_file import open_regular_file

LAST, STORE, CHUNK, ACTIVATION = 0, 1, 2, 3
"""Kinds of messages: the index of the others, the name of a recording, rows, and which blueprint applies."""
_KINDS = (LAST, STORE, CHUNK, ACTIVATION)
_START = struct.Struct("<4s4sBBxx")
_HEADER = struct.Struct("<QQ")
_TRAILER = struct.Struct("<QQI4s4sI")
START_BYTES, HEADER_BYTES, TRAILER_BYTES = _START.size, _HEADER.size, _TRAILER.size
_MAGIC, _END_MAGIC = b"RRF2", b"FOOT"
_PROTOBUF = 2
_SEED = 7850921  # prescribed by the format: the letters of RERUN as digits of base 26
_BLOCK = 1 << 20
_HEADER_PATTERN = re.compile(rb"(?=[\x01-\x03]\x00{7}.{4}\x00{4})", re.DOTALL)
"""What may be the header of a message of less than 4 GiB, except the last of a file. Matches may overlap."""


@contextmanager
def open_rrd_file(path: Path) -> Iterator[tuple[BinaryIO, int]]:
    """Yield a file, opened for reading, and its size; a file that cannot be read is a `SessionError`."""
    try:
        with open_regular_file(path) as file:
            yield file, os.fstat(file.fileno()).st_size
    except FileNotFoundError:
        raise SessionError(f"{path}: no such file") from None
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error.strerror}") from error


class RrdMessageSpan(NamedTuple):
    """The place of a complete message.

    Attributes:
        kind: `LAST`, `STORE`, `CHUNK` or `ACTIVATION`.
        start, length: first byte and number of bytes of the payload.
    """

    kind: int
    start: int
    length: int

    @property
    def begin(self) -> int:
        """The first byte of the message's header."""
        return self.start - HEADER_BYTES

    @property
    def end(self) -> int:
        """The byte after the message, and after the trailer of the file if this is the last message."""
        return self.start + self.length + (TRAILER_BYTES if self.kind == LAST else 0)


def check_rrd_start(file: BinaryIO) -> None:
    """Check that a file begins like a recording."""
    start = file.read(START_BYTES)
    if start[:4] != _MAGIC:
        raise SessionError("expected a Rerun recording (.rrd), found another kind of file")
    if len(start) < START_BYTES:
        raise SessionError("the file is torn: it ends within its first 12 bytes")
    if _START.unpack(start)[3] != _PROTOBUF:
        raise SessionError("byte 9: cannot be read as a recording: expected messages in protobuf")


def read_message_span(file: BinaryIO, place: int, size: int) -> RrdMessageSpan:
    """Return the message whose header is at a byte of a file of this size; a `SessionError` if none is."""
    file.seek(place)
    header = file.read(HEADER_BYTES)
    if len(header) < HEADER_BYTES:
        raise _torn_error(place, f"{len(header)} bytes of a message's header are left")
    kind, length = _HEADER.unpack(header)
    span = RrdMessageSpan(kind, place + HEADER_BYTES, length)
    if kind not in _KINDS:
        raise _torn_error(place, f"expected the header of a message, found kind {kind}")
    if span.end > size:
        left = size - span.start
        raise _torn_error(place, f"a message of {length} bytes begins there, {left} are left")
    if kind == LAST and span.end < size:
        raise _torn_error(place, f"the file should end here, but {size - span.end} bytes follow it")
    return span


def read_message_spans(file: BinaryIO, size: int) -> Iterator[RrdMessageSpan]:
    """Yield the messages of a file of this size in their order; its position may be changed in between.

    If the last message is cut off or a length is wrong, the complete messages before it are yielded first.
    """
    place = START_BYTES
    while place < size:
        span = read_message_span(file, place, size)
        yield span
        place = span.end


def find_span_candidates(file: BinaryIO, place: int, size: int) -> Iterator[RrdMessageSpan]:
    """Yield what looks like a message that fits into the file, from a byte on; whether it is one is unknown.

    The last message is found by the trailer of the file.
    """
    while place < size:
        file.seek(place)
        block = file.read(_BLOCK)
        for match in _HEADER_PATTERN.finditer(block):
            kind, length = _HEADER.unpack_from(block, match.start())
            span = RrdMessageSpan(kind, place + match.start() + HEADER_BYTES, length)
            if span.end <= size:
                yield span
        if len(block) < _BLOCK:
            break
        place += len(block) - HEADER_BYTES + 1  # a header may lie across two blocks
    if size >= TRAILER_BYTES:
        file.seek(size - TRAILER_BYTES)
        trailer = file.read(TRAILER_BYTES)
        start, length = _TRAILER.unpack(trailer)[:2]
        if is_trailer(trailer) and start + length == size - TRAILER_BYTES and start >= HEADER_BYTES:
            yield RrdMessageSpan(LAST, start, length)


def check_rrd_end(file: BinaryIO, last: RrdMessageSpan) -> None:
    """Check that the last message, an index of the others, has the checksum in the trailer."""
    file.seek(last.start)
    digest, left = xxh32(seed=_SEED), last.length
    while left > 0:
        block = file.read(min(left, _BLOCK))
        if not block:
            raise SessionError("the file was shortened while it was read")
        digest.update(block)
        left -= len(block)
    expected = _pack_trailer(last.start, last.length, digest.intdigest())
    if file.read(TRAILER_BYTES) != expected:
        raise SessionError(f"byte {last.start}: the file's index is damaged")


def encode_last_message(payload: bytes, begin: int) -> bytes:
    """Return the last message of a file, whose header is written at the byte `begin`, with the trailer."""
    trailer = _pack_trailer(begin + HEADER_BYTES, len(payload), xxh32(payload, seed=_SEED).intdigest())
    return _HEADER.pack(LAST, len(payload)) + payload + trailer


def read_span_in_buffer(data: bytes | bytearray, place: int) -> RrdMessageSpan:
    """Return the message whose header is at a place in these bytes, which may end within its payload."""
    kind, length = _HEADER.unpack_from(data, place)
    return RrdMessageSpan(kind, place + HEADER_BYTES, length)


def is_trailer(data: bytes) -> bool:
    """Return whether these are the bytes that end a file, as far as can be told without the rest."""
    return len(data) == TRAILER_BYTES and _TRAILER.unpack(data)[3:] == (_MAGIC, _END_MAGIC, 1)


def _pack_trailer(start: int, length: int, checksum: int) -> bytes:
    return _TRAILER.pack(start, length, checksum, _MAGIC, _END_MAGIC, 1)


def _torn_error(place: int, why: str) -> SessionError:
    return SessionError(f"the file is torn: byte {place}: {why}")
