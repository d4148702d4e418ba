"""Decode the messages of an .rrd file, without Rerun's own library: damaged messages make it abort.

The head of a chunk's message tells whose rows it holds and how many, without the rows themselves. Damaged
messages are a `ValueError` or an `ArrowException`.
"""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import BinaryIO, NamedTuple

import pyarrow as pa

from pdtui.sessions.rrd.arrow_checks import read_batch_header, read_record_batch
from pdtui.sessions.rrd.message_framing import RrdMessageSpan
from pdtui.sessions.rrd.protobuf_wire import (
    Value,
    protobuf_bytes_field,
    protobuf_number_field,
    protobuf_text_field,
    read_fields,
)

MAX_MESSAGE = 256 << 20
"""Largest size of a message, bytes, compressed or not. A batch of 1000 steps of 4096 units takes 16 MB."""
_ENTITY_PATH, _KIND, _INDEX = b"rerun:entity_path", b"rerun:kind", b"index"
_PLAIN, _LZ4 = (0, 1), 2
_LZ4_RATIO = 255  # the largest factor by which an LZ4 block can grow
_ARROW_IPC = 1
_HEAD_BYTES = 4096
"""How much of a long message is read. What precedes the rows takes 1 to 2.5 kB in a session."""
_READ_WHOLE = 4 * _HEAD_BYTES
"""Messages up to this size are read whole: Arrow decompresses them faster than Python does their start."""

_SHORT = 15
"""An LZ4 length that fits into its token is smaller; otherwise further bytes are added to it."""
_SHORTEST_MATCH = 4
_IPC_PREFIX = struct.Struct("<II")


class RrdStoreInfo(NamedTuple):
    """The store, in Rerun's terms, of a message: a recording or a blueprint, and what program wrote it."""

    is_recording: bool
    recording_id: str
    application_id: str


class EntityChunk(NamedTuple):
    """Rows of one entity; `timelines` are columns that say when a row applies: none if it always does."""

    entity: str
    timelines: tuple[str, ...]
    batch: pa.RecordBatch


class ChunkHead(NamedTuple):
    """What a chunk's message begins with: whose rows it holds and how many."""

    store: RrdStoreInfo
    entity: str
    rows: int


def decode_store_info(payload: memoryview) -> RrdStoreInfo:
    """Return the store that a message announces."""
    return _decode_store(read_fields(protobuf_bytes_field(read_fields(payload), 2)), 2)


def decode_chunk(payload: memoryview) -> tuple[RrdStoreInfo, EntityChunk]:
    """Decode a message that contains rows."""
    message = read_fields(payload)
    if protobuf_number_field(message, 4) != _ARROW_IPC:
        raise ValueError("expected rows in Arrow's format")
    batch = read_record_batch(_unpack_payload(message))
    metadata = batch.schema.metadata or {}
    if _ENTITY_PATH not in metadata:
        raise ValueError("the rows name no entity")
    timelines = tuple(field.name for field in batch.schema if (field.metadata or {}).get(_KIND) == _INDEX)
    return _decode_store(message), EntityChunk(metadata[_ENTITY_PATH].decode(), timelines, batch)


def _decode_store(message: dict[int, Value], field: int = 1) -> RrdStoreInfo:
    return _decode_store_bytes(bytes(protobuf_bytes_field(message, field)))


@lru_cache(maxsize=32)
def _decode_store_bytes(store: bytes) -> RrdStoreInfo:
    found = read_fields(memoryview(store))
    application = protobuf_text_field(read_fields(protobuf_bytes_field(found, 3)), 1)
    return RrdStoreInfo(protobuf_number_field(found, 1) == 1, protobuf_text_field(found, 2), application)


def _unpack_payload(message: dict[int, Value], *, whole: bool = True) -> pa.Buffer:
    """Return the rows of a chunk's message, or only what precedes them, as an Arrow IPC stream."""
    packed, compression, size = (
        protobuf_bytes_field(message, 5),
        protobuf_number_field(message, 2),
        protobuf_number_field(message, 3),
    )
    if compression in _PLAIN:
        return pa.py_buffer(bytes(packed))
    if compression != _LZ4:
        raise ValueError(f"unknown compression {compression}")
    if not whole:
        return decompress_start(packed)
    if size > min(MAX_MESSAGE, _LZ4_RATIO * len(packed)):
        raise ValueError(f"{len(packed)} bytes cannot unpack to {size}, or must not")
    return pa.decompress(packed, size, codec="lz4_raw")


def read_chunk_head(file: BinaryIO, frame: RrdMessageSpan, own: RrdStoreInfo | None) -> ChunkHead | None:
    """Read the head of a chunk; None if it cannot be told, so that the whole message has to be decoded.

    The chunks of stores other than `own` are given without an entity.
    """
    whole = frame.length <= _READ_WHOLE
    try:
        file.seek(frame.start)
        message = read_fields(memoryview(file.read(frame.length if whole else _HEAD_BYTES)), cut=not whole)
        store = _decode_store(message)
        if store != own:
            return ChunkHead(store, "", 0)
        data = _unpack_payload(message, whole=whole)
        schema = pa.ipc.MessageReader.open_stream(data).read_next_message()
        if schema.type != "schema":
            return None
        entity = (pa.ipc.read_schema(schema).metadata or {})[_ENTITY_PATH].decode()
        begin, end = (_metadata_end(data, messages) for messages in (1, 2))
        if end > len(data):
            return None
        rows, _ = read_batch_header(memoryview(data)[begin + _IPC_PREFIX.size : end])
        return ChunkHead(store, entity, rows)
    except (ValueError, KeyError, IndexError, StopIteration, OSError, struct.error, pa.ArrowException):
        return None


def decompress_start(packed: memoryview) -> pa.Buffer:
    """Decompress the start of an LZ4 block up to the rows, which Arrow does only for whole blocks."""
    out = bytearray()
    place = 0
    needed = 0
    while place < len(packed):
        if len(out) >= needed:
            needed = _metadata_end(out, messages=2)
            if len(out) >= needed:
                break
        token = packed[place]
        literals, place = _read_length(packed, place + 1, token >> 4)
        out += packed[place : place + literals]
        place += literals
        if place + 2 >= len(packed):
            break
        begin = len(out) - (packed[place] | packed[place + 1] << 8)
        count, place = _read_length(packed, place + 2, token & 15)
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


def _read_length(packed: memoryview, place: int, length: int) -> tuple[int, int]:
    if length == _SHORT:
        while True:
            length += packed[place]
            place += 1
            if packed[place - 1] != 255:
                break
    return length, place
