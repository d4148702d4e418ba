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

_HEAD_BYTES = 4096
"""How much of a long message is read. What precedes the rows takes 1 to 2.5 kB in a session."""
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
        begin, end = (_metadata_end(data, messages) for messages in (1, 2))
        if end > len(data):
            return None
        return ChunkHead(store, entity, count_rows(memoryview(data)[begin + _IPC_PREFIX.size : end]))
    except (ValueError, KeyError, IndexError, StopIteration, OSError, struct.error, pa.ArrowException):
        return None


def decompress_start(packed: memoryview, _size: int) -> pa.Buffer:
    """Decompress the start of an LZ4 block up to the rows, which Arrow does only for whole blocks.

    Raises:
        ValueError, IndexError: it is damaged.
    """
    out = bytearray()
    place = 0
    needed = 0
    while place < len(packed):
        if len(out) >= needed:
            needed = _metadata_end(out, messages=2)
            if len(out) >= needed:
                break
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


def _metadata_end(data: bytearray | pa.Buffer, messages: int) -> int:
    """Return where the metadata of a number of IPC messages end, as far as the data tell."""
    end = 0
    for _ in range(messages):
        if len(data) < end + _IPC_PREFIX.size:
            return end + _IPC_PREFIX.size
        end += _IPC_PREFIX.size + int(_IPC_PREFIX.unpack_from(data, end)[1])
    return end


def _length(packed: memoryview, place: int, length: int) -> tuple[int, int]:
    if length == _SHORT:
        while True:
            length += packed[place]
            place += 1
            if packed[place - 1] != 255:
                break
    return length, place
