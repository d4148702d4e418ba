"""Adapt the index at the end of an .rrd file to messages that have become longer.

The last message of a file, its footer, contains a table for each recording and blueprint that says where its
chunks are: a column of positions and one of sizes, among others.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pdtui.sessions.rrd.protobuf_wire import (
    Value,
    encode_bytes_field,
    encode_number_field,
    iterate_fields,
    protobuf_bytes_field,
    protobuf_number_field,
    read_fields,
)

_MANIFEST = 1  # field of the footer
_TABLE = 4  # field of a manifest
_CONTENT, _COMPRESSION, _PLAIN_SIZE = 2, 3, 4  # fields of a table
_LZ4, _CODEC = 2, "lz4_raw"
_Change = Callable[[memoryview], bytes]
_OFFSETS, _SIZES = "chunk_byte_offset", "chunk_byte_size"


def shift_footer_positions(footer: memoryview, starts: NDArray[np.uint64], longer: int) -> bytes:
    """Return the payload of a footer for a file in which each message is `longer` by so many bytes.

    Args:
        footer: the payload of the last message.
        starts: where the payloads of the messages began, in the order of the file.
        longer: number of bytes by which each message has become longer.

    Raises:
        ValueError: the footer is not built as expected.
    """

    def adapt(fields: memoryview, field: int, change: _Change) -> bytes:
        parts = []
        for number, value in iterate_fields(fields):
            if number != field or isinstance(value, int):
                parts.append(_encode_field(number, value))
            else:
                parts.append(encode_bytes_field(number, change(value)))
        return b"".join(parts)

    def adapt_table(table: memoryview) -> bytes:
        return _move_table(read_fields(table), starts, longer)

    return adapt(footer, _MANIFEST, lambda manifest: adapt(manifest, _TABLE, adapt_table))


def _move_table(table: dict[int, Value], starts: NDArray[np.uint64], longer: int) -> bytes:
    content = protobuf_bytes_field(table, _CONTENT)
    compressed = protobuf_number_field(table, _COMPRESSION) == _LZ4
    plain = pa.py_buffer(content)
    if compressed:
        plain = pa.decompress(plain, protobuf_number_field(table, _PLAIN_SIZE), codec=_CODEC)
    # The two columns are changed in place: everything else stays as Rerun wrote it.
    changed = bytearray(plain)
    buffer = pa.py_buffer(changed)
    batch = pa.ipc.open_stream(buffer).read_next_batch()

    def column(name: str) -> NDArray[np.uint64]:
        array = batch.column(name)
        if array.type != pa.uint64() or array.null_count:
            raise ValueError(f"the file's index: column '{name}' is not of the expected type")
        data = array.buffers()[1]
        place = data.address - buffer.address + 8 * array.offset
        return np.frombuffer(changed, np.uint64, batch.num_rows, place)

    offsets = column(_OFFSETS)
    numbers = np.searchsorted(starts, offsets)
    if len(offsets) and (numbers.max() >= len(starts) or (starts[numbers] != offsets).any()):
        raise ValueError("the file's index points to bytes at which no message begins")
    offsets += np.uint64(longer) * numbers.astype(np.uint64)
    column(_SIZES)[:] += np.uint64(longer)
    packed = pa.compress(buffer, codec=_CODEC, asbytes=True) if compressed else bytes(changed)
    return b"".join(
        _encode_field(number, memoryview(packed) if number == _CONTENT else value)
        for number, value in table.items()
    )


def _encode_field(number: int, value: Value) -> bytes:
    if isinstance(value, int):
        return encode_number_field(number, value)
    return encode_bytes_field(number, value)
