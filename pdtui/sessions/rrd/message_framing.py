"""Find the messages of an .rrd file.

A file begins with 12 bytes. Messages follow, each after a header of 16 bytes: its kind and its length. The
last message is of kind 0 and is followed by 32 bytes that contain its position, length and checksum. A file
that is torn or damaged is a `SessionError` that names the byte but not the file.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from xxhash import xxh32

from pdtui.core.errors import SessionError

LAST, STORE, CHUNK = 0, 1, 2
RESCUE = "`pdtui sessions repair` rescues what precedes it"
_KINDS = 4
_START = struct.Struct("<4s4sBBxx")
_HEADER = struct.Struct("<QQ")
_TRAILER = struct.Struct("<QQI4s4sI")
_MAGIC, _END_MAGIC = b"RRF2", b"FOOT"
_PROTOBUF = 2
_SEED = 7850921  # prescribed by the format: the letters of RERUN as digits of base 26
_BLOCK = 1 << 20


class RrdMessageSpan(NamedTuple):
    """The place of a complete message.

    Attributes:
        kind: `LAST`, `STORE`, `CHUNK`, or another kind, which a session does not need.
        start, length: first byte and number of bytes of the payload.
    """

    kind: int
    start: int
    length: int

    @property
    def end(self) -> int:
        """The byte after the message, and after the trailer of the file if this is the last message."""
        return self.start + self.length + (_TRAILER.size if self.kind == LAST else 0)


def check_rrd_start(file: BinaryIO) -> None:
    """Check that a file begins like a recording."""
    start = file.read(_START.size)
    if start[:4] != _MAGIC:
        raise SessionError("expected a Rerun recording (.rrd), found another kind of file")
    if len(start) < _START.size:
        raise SessionError("the file is torn: it ends within its first 12 bytes")
    if _START.unpack(start)[3] != _PROTOBUF:
        raise SessionError("byte 9: cannot be read as a recording: expected messages in protobuf")


def read_message_frames(file: BinaryIO, size: int) -> Iterator[RrdMessageSpan]:
    """Yield the messages of a file of this size in their order; its position may be changed in between.

    If the last message is cut off or a length is wrong, the complete messages before it are yielded first.
    """
    place = _START.size
    while place < size:
        file.seek(place)
        header = file.read(_HEADER.size)
        if len(header) < _HEADER.size:
            raise _torn_error(place, f"{len(header)} bytes of a message's header are left")
        kind, length = _HEADER.unpack(header)
        frame = RrdMessageSpan(kind, place + _HEADER.size, length)
        if kind >= _KINDS:
            raise _torn_error(place, f"expected the header of a message, found kind {kind}")
        if frame.end > size:
            left = size - frame.start
            raise _torn_error(place, f"a message of {length} bytes begins there, {left} are left")
        if kind == LAST and frame.end < size:
            extra = size - frame.end
            raise _torn_error(place, f"the file should end here, but {extra} bytes follow it")
        yield frame
        place = frame.end


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
    trailer = file.read(_TRAILER.size)
    expected = _TRAILER.pack(last.start, last.length, digest.intdigest(), _MAGIC, _END_MAGIC, 1)
    if trailer != expected:
        raise SessionError(f"byte {last.start}: the file's index is damaged; {RESCUE}")


def undamaged_length(path: Path) -> int:
    """Return the number of bytes up to which every message is complete; the file's size if all are."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            place = min(_START.size, size)
            try:
                for frame in read_message_frames(file, size):
                    place = frame.end
            except SessionError:
                pass
            return place
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error.strerror}") from error


def _torn_error(place: int, why: str) -> SessionError:
    return SessionError(f"the file is torn: byte {place}: {why}; {RESCUE}")
