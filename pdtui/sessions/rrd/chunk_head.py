"""The head of a chunk's message: whose rows it holds and how many, without the rows themselves."""

from __future__ import annotations

import struct
from typing import BinaryIO, NamedTuple

import pyarrow as pa

from pdtui.sessions.rrd.arrow_checks import count_rows
from pdtui.sessions.rrd.message_decoder import (
    ENTITY_PATH,
    StoreInfo,
    decode_store,
    decompress_whole,
    unpack_payload,
)
from pdtui.sessions.rrd.message_framing import MessageFrame
from pdtui.sessions.rrd.protobuf_fields import read_fields

_HEAD_BYTES, _UNPACKED_BYTES = 4096, 8192
"""How much of a long message is read and decompressed. Types and sizes of a session's columns take 4 kB."""
_READ_WHOLE = 4 * _HEAD_BYTES
"""Messages up to this size are read whole: Arrow decompresses them faster than Python does their start."""

_SHORT = 15
"""An LZ4 length that fits into its token is smaller; otherwise further bytes are added to it."""
_SHORTEST_MATCH = 4
_IPC_PREFIX = struct.Struct("<II")


class ChunkHead(NamedTuple):
    """What a chunk's message begins with.

    Attributes:
        store: the recording or blueprint that the chunk belongs to.
        entity: path of its entity.
        rows: number of its rows.
    """

    store: StoreInfo
    entity: str
    rows: int


def read_chunk_head(file: BinaryIO, frame: MessageFrame, own: StoreInfo | None) -> ChunkHead | None:
    """Read the head of a chunk.

    Args:
        file: an open recording.
        frame: of the chunk's message.
        own: the store of interest; the chunks of others are given without an entity.

    Returns:
        The head; None if it cannot be told, so that the whole message has to be decoded.
    """
    whole = frame.length <= _READ_WHOLE
    try:
        file.seek(frame.start)
        message = read_fields(memoryview(file.read(frame.length if whole else _HEAD_BYTES)), cut=not whole)
        store = decode_store(message)
        if store != own:
            return ChunkHead(store, "", 0)
        data = unpack_payload(message, decompress_whole if whole else decompress_start)
        schema = pa.ipc.MessageReader.open_stream(data).read_next_message()
        if schema.type != "schema":
            return None
        entity = (pa.ipc.read_schema(schema).metadata or {})[ENTITY_PATH].decode()
        second = _IPC_PREFIX.size + _IPC_PREFIX.unpack_from(data)[1]
        size = _IPC_PREFIX.unpack_from(data, second)[1]
        metadata = memoryview(data)[second + _IPC_PREFIX.size :][:size]
        return ChunkHead(store, entity, count_rows(metadata)) if len(metadata) == size else None
    except (ValueError, KeyError, IndexError, StopIteration, OSError, struct.error, pa.ArrowException):
        return None


def decompress_start(packed: memoryview, _size: int) -> pa.Buffer:
    """Decompress the start of an LZ4 block as far as it is there; Arrow accepts only whole blocks.

    Raises:
        ValueError, IndexError: it is damaged.
    """
    out = bytearray()
    place = 0
    while place < len(packed) and len(out) < _UNPACKED_BYTES:
        token = packed[place]
        literals, place = _length(packed, place + 1, token >> 4)
        out += packed[place : place + literals]
        place += literals
        if place + 2 >= len(packed):
            break
        begin = len(out) - (packed[place] | packed[place + 1] << 8)
        count, place = _length(packed, place + 2, token & 15)
        count += _SHORTEST_MATCH
        if not 0 <= begin < len(out):
            raise ValueError("a match begins before the block")
        match = out[begin : begin + count]
        # A match may run into what it writes: its beginning is then repeated.
        out += match if len(match) == count else (match * -(-count // len(match)))[:count]
    return pa.py_buffer(bytes(out))


def _length(packed: memoryview, place: int, length: int) -> tuple[int, int]:
    if length == _SHORT:
        while True:
            length += packed[place]
            place += 1
            if packed[place - 1] != 255:
                break
    return length, place
