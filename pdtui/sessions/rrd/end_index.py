"""A session's own index at the end of its file: what `sessions list` and `show` print, without reading the
rest.

It is a field of the file's last message, the footer, which Rerun's own readers skip as unknown. The field is
the last of the footer: a JSON object, compressed with zlib, its length (4 bytes), a mark (4 bytes) and an
XXH3 checksum (8 bytes). It is found from the end of the file, before the trailer.
"""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path
from typing import Any, BinaryIO

from xxhash import xxh3_64_intdigest

from pdtui.sessions.rrd.message_framing import TRAILER_BYTES, is_trailer, open_rrd_file
from pdtui.sessions.rrd.protobuf_wire import encode_bytes_field

_FIELD = 2046
_MARK = b"PDTI"
_END = struct.Struct("<I4sQ")
_MAX_PACKED, _MAX_PLAIN = 32 << 20, 128 << 20
"""Largest size of an index, bytes, compressed and not. A key press takes about 30 bytes, or 4 compressed."""


def encode_end_index(index: dict[str, Any]) -> bytes:
    """Return the field that contains an index, to be appended to the footer."""
    packed = zlib.compress(json.dumps(index).encode(), level=6)
    end = _END.pack(len(packed), _MARK, xxh3_64_intdigest(packed))
    return encode_bytes_field(_FIELD, packed + end)


def read_end_index(path: Path) -> dict[str, Any] | None:
    """Return the index of a session; None if it has none, or a damaged one.

    Raises:
        SessionError: the file does not exist or cannot be read.
    """
    with open_rrd_file(path) as (file, size):
        return _read_index(file, size)


def _read_index(file: BinaryIO, size: int) -> dict[str, Any] | None:
    after = size - TRAILER_BYTES  # where the index ends
    if after < _END.size:
        return None
    file.seek(after - _END.size)
    length, mark, checksum = _END.unpack(file.read(_END.size))
    if mark != _MARK or length > min(_MAX_PACKED, after - _END.size) or not is_trailer(file.read()):
        return None
    file.seek(after - _END.size - length)
    packed = file.read(length)
    if xxh3_64_intdigest(packed) != checksum:
        return None
    try:
        unpacking = zlib.decompressobj()
        plain = unpacking.decompress(packed, _MAX_PLAIN)
        index = json.loads(plain) if unpacking.eof else None
    except (zlib.error, ValueError, RecursionError):
        return None
    return index if isinstance(index, dict) else None
