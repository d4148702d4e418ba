"""Decode the messages of an .rrd file, without Rerun's own library: damaged messages make it abort."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import pyarrow as pa

from pdtui.sessions.rrd.arrow_checks import read_record_batch
from pdtui.sessions.rrd.protobuf_fields import Value, bytes_field, number_field, read_fields, text_field

MAX_MESSAGE = 256 << 20
"""Largest size of a message, bytes, compressed or not. A batch of 1000 steps of 4096 units takes 16 MB."""

_LZ4_RATIO = 255  # the largest factor by which an LZ4 block can grow
_PLAIN, _LZ4 = (0, 1), 2
_ARROW_IPC = 1
ENTITY_PATH = b"rerun:entity_path"
_KIND, _INDEX = b"rerun:kind", b"index"


@dataclass(frozen=True)
class StoreInfo:
    """The store, in Rerun's terms, to which a message belongs: a recording or a blueprint.

    Attributes:
        is_recording: whether it is a recording rather than a blueprint.
        recording_id: its identifier.
        application_id: the name of the program that wrote it.
    """

    is_recording: bool
    recording_id: str
    application_id: str


@dataclass(frozen=True)
class EntityChunk:
    """A batch of rows of one entity.

    Attributes:
        entity: path of the entity.
        timelines: names of the columns that say when a row applies; empty if the rows apply at all times.
        batch: the rows.
    """

    entity: str
    timelines: tuple[str, ...]
    batch: pa.RecordBatch


def decode_store_info(payload: memoryview) -> StoreInfo:
    """Return the store that a message announces.

    Raises:
        ValueError: the message is damaged.
    """
    return _decode_store(bytes(bytes_field(read_fields(bytes_field(read_fields(payload), 2)), 2)))


def decode_chunk(payload: memoryview) -> tuple[StoreInfo, EntityChunk]:
    """Decode a message that contains rows.

    Raises:
        ValueError, pyarrow.ArrowException: the message is damaged, or would take too much memory.
    """
    message = read_fields(payload)
    store = decode_store(message)
    if number_field(message, 4) != _ARROW_IPC:
        raise ValueError("expected rows in Arrow's format")
    batch = read_record_batch(unpack_payload(message, decompress_whole))
    metadata = batch.schema.metadata or {}
    if ENTITY_PATH not in metadata:
        raise ValueError("the rows name no entity")
    timelines = tuple(field.name for field in batch.schema if (field.metadata or {}).get(_KIND) == _INDEX)
    return store, EntityChunk(metadata[ENTITY_PATH].decode(), timelines, batch)


def decode_store(chunk_message: dict[int, Value]) -> StoreInfo:
    """Return the store that a chunk belongs to.

    Raises:
        ValueError: the message is damaged.
    """
    return _decode_store(bytes(bytes_field(chunk_message, 1)))


@lru_cache(maxsize=32)
def _decode_store(store: bytes) -> StoreInfo:
    found = read_fields(memoryview(store))
    application = text_field(read_fields(bytes_field(found, 3)), 1)
    return StoreInfo(number_field(found, 1) == 1, text_field(found, 2), application)


def unpack_payload(
    message: dict[int, Value], decompress: Callable[[memoryview, int], pa.Buffer]
) -> pa.Buffer:
    """Return the rows of a chunk's message as an Arrow IPC stream.

    Args:
        message: the fields of the message.
        decompress: decompresses an LZ4 block, given its bytes and the size that the message claims.

    Raises:
        ValueError, pyarrow.ArrowException: the message is damaged.
    """
    packed, compression = bytes_field(message, 5), number_field(message, 2)
    if compression in _PLAIN:
        return pa.py_buffer(bytes(packed))
    if compression != _LZ4:
        raise ValueError(f"unknown compression {compression}")
    return decompress(packed, number_field(message, 3))


def decompress_whole(packed: memoryview, size: int) -> pa.Buffer:
    """Decompress an LZ4 block.

    Raises:
        ValueError, pyarrow.ArrowException: it is damaged or too large.
    """
    if size > min(MAX_MESSAGE, _LZ4_RATIO * len(packed)):
        raise ValueError(f"{len(packed)} bytes cannot unpack to {size}, or must not")
    return pa.decompress(packed, size, codec="lz4_raw")
