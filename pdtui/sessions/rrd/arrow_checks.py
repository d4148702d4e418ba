"""Read Arrow data from untrusted files: every offset is checked, and memory bombs are refused.

Arrow's format can expand far beyond the size of the file: compressed buffers, columns of nulls with any
number of rows, dictionaries and runs that repeat one value. Rerun writes none of these, so they are refused;
anything else takes as much memory as it has bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from functools import lru_cache

import pyarrow as pa

MAX_ROWS = 1 << 20
_MAX_COLUMNS = 1000
_MAX_DEPTH = 6
_SCHEMA, _BATCH = "schema", "record batch"
_SIZED = "boolean integer floating temporal string large_string binary large_binary"
_HEADER_TYPE, _HEADER = 1, 2  # fields of a message
_LENGTH, _COMPRESSION = 0, 3  # fields of a record batch
_RECORD_BATCH = 3  # type of a header


def read_record_batch(data: pa.Buffer) -> pa.RecordBatch:
    """Read an IPC stream that consists of a schema and one record batch.

    A damaged or hostile one is a `ValueError` or an `ArrowException`.
    """
    reader = pa.ipc.MessageReader.open_stream(data)
    try:
        first, message = reader.read_next_message(), reader.read_next_message()
    except StopIteration:
        raise ValueError("expected a schema and a record batch, found less") from None
    if first.type != _SCHEMA:  # Arrow would interpret any message as a schema, and crash
        raise ValueError(f"expected a {_SCHEMA}, found a {first.type}")
    schema = pa.ipc.read_schema(first)
    if len(schema) > _MAX_COLUMNS:
        raise ValueError(f"expected at most {_MAX_COLUMNS} columns, found {len(schema)}")
    _check_texts(schema.metadata)
    for field in schema:
        _check_type(field.type, _MAX_DEPTH)
        _check_field(field)
    if message.type != _BATCH:
        raise ValueError(f"expected a {_BATCH}, found a {message.type}")
    _, compressed = read_batch_header(memoryview(message.metadata))
    if compressed:
        raise ValueError("expected uncompressed buffers, found compressed ones")
    batch = pa.ipc.read_record_batch(message, schema)
    batch.validate(full=True)
    return batch


def _check_field(field: pa.Field) -> None:
    """Check that names are UTF-8, which Rerun requires and Arrow does not; reading a name decodes it."""
    kind, _ = field.type, field.name
    _check_texts(field.metadata)
    for index in range(kind.num_fields):
        _check_field(kind.field(index))


def _check_texts(metadata: Mapping[bytes, bytes] | None) -> None:
    for pair in (metadata or {}).items():
        for text in pair:
            text.decode()


@lru_cache(maxsize=256)
def _check_type(kind: pa.DataType, depth: int) -> None:
    """Refuse types whose arrays may be longer than their buffers."""
    types = pa.types
    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        inner, sized = [kind.value_type], not types.is_fixed_size_list(kind) or kind.list_size > 0
    elif types.is_struct(kind) or types.is_union(kind):
        inner, sized = [kind.field(index).type for index in range(kind.num_fields)], kind.num_fields > 0
        if types.is_union(kind):  # a union stores the type of each row, even where the type is null
            inner = [one for one in inner if not types.is_null(one)]
    else:
        inner = []
        sized = any(getattr(types, f"is_{name}")(kind) for name in _SIZED.split())
        sized = sized or (types.is_fixed_size_binary(kind) and kind.byte_width > 0)
    if not sized:
        raise ValueError(f"a column of type {str(kind)[:80]} is not expected in a recording")
    if inner and not depth:
        raise ValueError(f"expected columns nested at most {_MAX_DEPTH} deep")
    for one in inner:
        _check_type(one, depth - 1)


def read_batch_header(metadata: memoryview) -> tuple[int, bool]:
    """Return the number of rows of a record batch and whether they are compressed, from its metadata.

    Only the flatbuffer of the message tells beforehand. Damaged metadata are a `ValueError`.
    """
    try:
        (root,) = struct.unpack_from("<I", metadata, 0)
        kind, header = _locate_field(metadata, root, _HEADER_TYPE), _locate_field(metadata, root, _HEADER)
        if kind is None or header is None or metadata[kind] != _RECORD_BATCH:
            raise ValueError("expected the metadata of a record batch")
        header += struct.unpack_from("<I", metadata, header)[0]
        length = _locate_field(metadata, header, _LENGTH)
        rows = 0 if length is None else struct.unpack_from("<q", metadata, length)[0]
        compressed = _locate_field(metadata, header, _COMPRESSION) is not None
    except (struct.error, IndexError) as error:
        raise ValueError(f"the header of a message is damaged: {error}") from error
    if not 0 <= rows <= MAX_ROWS:
        raise ValueError(f"expected at most {MAX_ROWS} rows, found {rows}")
    return int(rows), compressed


def _locate_field(view: memoryview, table: int, number: int) -> int | None:
    """Return the position of a field in a table of a flatbuffer; None if the table lacks the field."""
    (back,) = struct.unpack_from("<i", view, table)
    places = table - back
    if places < 0:
        raise ValueError("the header of a message is damaged")
    (size,) = struct.unpack_from("<H", view, places)
    if 4 + 2 * number >= size:
        return None
    (place,) = struct.unpack_from("<H", view, places + 4 + 2 * number)
    return table + place if place else None
