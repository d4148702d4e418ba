"""Checksums of the messages of a session, by which damage shows without running anything.

pdtui adds a field to each message that Rerun encodes; Rerun's own readers skip fields that they do not know.
The field is the last of the message and contains 12 bytes:

- the link, 4 bytes: the lower half of the checksum of the message before it; in the first message, of that of
  the bytes before it. A message that is missing, or that was put in, breaks the chain.
- the checksum, 8 bytes: XXH3 of the message's header, its payload before the field, and the link.

The checksum finds accidents, not forgery: anyone can compute it.
"""

from __future__ import annotations

import re
import struct
from typing import NamedTuple

from xxhash import xxh3_64, xxh3_64_intdigest

from pdtui.sessions.rrd.protobuf_wire import encode_tag

_FIELD = 2047
"""Number of the field; Rerun numbers its own from 1."""
_SEAL = struct.Struct("<IQ")
_MARK = encode_tag(_FIELD, _SEAL.size)
SEAL_BYTES = len(_MARK) + _SEAL.size
"""Number of bytes by which a checksum makes a message longer."""

SEAL_PATTERN = re.escape(_MARK) + rb".{%d}" % _SEAL.size
"""Regular expression for the end of a message that has a checksum."""

_HEADER = struct.Struct("<QQ")


class MessageSeal(NamedTuple):
    """The checksum of a message, and the lower half of that of the message before it."""

    link: int
    checksum: int


def compute_start_checksum(start: bytes | bytearray) -> int:
    """Return the checksum of the bytes with which a file starts, before its first message."""
    return xxh3_64_intdigest(bytes(start))


def seal_message(kind: int, payload: bytes | memoryview, previous: int) -> tuple[bytes, bytes, int]:
    """Return a message's header, the field to append to its payload, and its checksum.

    `previous` is the checksum of the message before it, or of the start of the file.
    """
    link = previous & 0xFFFFFFFF
    length = len(payload) + SEAL_BYTES
    checksum = compute_message_checksum(kind, length, payload, link)
    return _HEADER.pack(kind, length), _MARK + _SEAL.pack(link, checksum), checksum


def read_message_seal(payload: bytes | memoryview) -> MessageSeal | None:
    """Return the seal at the end of a payload; None if it has none."""
    if len(payload) < SEAL_BYTES or payload[-SEAL_BYTES : -_SEAL.size] != _MARK:
        return None
    return MessageSeal(*_SEAL.unpack(payload[-_SEAL.size :]))


def compute_message_checksum(kind: int, length: int, payload: bytes | memoryview, link: int) -> int:
    """Return the checksum of a message of this length, seal included, from its payload without the seal."""
    digest = xxh3_64(_HEADER.pack(kind, length))
    digest.update(payload)
    digest.update(link.to_bytes(4, "little"))
    return digest.intdigest()
