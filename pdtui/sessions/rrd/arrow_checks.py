"""Arrow data from anywhere: checked to the last offset, and never larger than it looks.

Arrow's own format can announce more than it holds: compressed buffers, columns of nothing that have any
number of rows, dictionaries and runs that repeat one value. Rerun writes none of these, so they are refused;
what is left takes as much memory as it has bytes.
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
_SIZED = (
    pa.types.is_boolean,
    pa.types.is_integer,
    pa.types.is_floating,
    pa.types.is_temporal,
    pa.types.is_string,
    pa.types.is_large_string,
    pa.types.is_binary,
    pa.types.is_large_binary,
)
_HEADER_TYPE, _HEADER = 1, 2  # fields of a message
_LENGTH, _COMPRESSION = 0, 3  # fields of a record batch
_RECORD_BATCH = 3  # type of a header


def read_record_batch(data: pa.Buffer) -> pa.RecordBatch:
    """The only record batch of an IPC stream.

    Args:
        data: the stream.

    Raises:
        pyarrow.ArrowException: it is damaged.
        ValueError: it is not what Rerun writes, or too large.
    """
    reader = pa.ipc.MessageReader.open_stream(data)
    try:
        first, message = reader.read_next_message(), reader.read_next_message()
    except StopIteration:
        raise ValueError("expected a schema and a record batch, found less") from None
    if first.type != _SCHEMA:  # Arrow would take any message for one, and crash
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
    if _is_compressed(message.metadata):
        raise ValueError("expected buffers as they are, found compressed ones")
    batch = pa.ipc.read_record_batch(message, schema)
    if batch.num_rows > MAX_ROWS:
        raise ValueError(f"expected at most {MAX_ROWS} rows, found {batch.num_rows}")
    batch.validate(full=True)
    return batch


def _check_field(field: pa.Field) -> None:
    """See that names are text, which Arrow does not ask for and Rerun does; reading a name decodes it."""
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
        if types.is_union(kind):  # says for each row which of its types it has, also where that is none
            inner = [one for one in inner if not types.is_null(one)]
    else:
        inner = []
        sized = any(test(kind) for test in _SIZED) or (
            types.is_fixed_size_binary(kind) and kind.byte_width > 0
        )
    if not sized:
        raise ValueError(f"a column of type {str(kind)[:80]} has no place in a recording")
    if inner and not depth:
        raise ValueError(f"expected columns nested at most {_MAX_DEPTH} deep")
    for one in inner:
        _check_type(one, depth - 1)


def count_rows(metadata: memoryview) -> int:
    """Return the number of rows of a record batch, from the metadata of its message.

    Raises:
        ValueError: the metadata are damaged or belong to another kind of message.
    """
    try:
        (root,) = struct.unpack_from("<I", metadata, 0)
        kind, length = _field(metadata, root, _HEADER_TYPE), _field(metadata, _header(metadata), _LENGTH)
        if kind is None or metadata[kind] != _RECORD_BATCH:
            raise ValueError("expected the metadata of a record batch")
        rows = 0 if length is None else struct.unpack_from("<q", metadata, length)[0]
    except (struct.error, IndexError) as error:
        raise ValueError(f"a message whose header is damaged: {error}") from error
    if not 0 <= rows <= MAX_ROWS:
        raise ValueError(f"expected at most {MAX_ROWS} rows, found {rows}")
    return int(rows)


def _is_compressed(metadata: pa.Buffer) -> bool:
    """Whether a record batch names a codec; only its flatbuffer says so before the buffers are unpacked."""
    view = memoryview(metadata)
    try:
        return _field(view, _header(view), _COMPRESSION) is not None
    except struct.error as error:
        raise ValueError(f"a message whose header is damaged: {error}") from error


def _header(view: memoryview) -> int:
    """Where the header of a message begins."""
    (root,) = struct.unpack_from("<I", view, 0)
    header = _field(view, root, _HEADER)
    if header is None:
        raise ValueError("a message without a header")
    return int(header + struct.unpack_from("<I", view, header)[0])


def _field(view: memoryview, table: int, number: int) -> int | None:
    """Where a table of a flatbuffer has a field; None where it has not."""
    (back,) = struct.unpack_from("<i", view, table)
    places = table - back
    if places < 0:
        raise ValueError("a message whose header is damaged")
    (size,) = struct.unpack_from("<H", view, places)
    if 4 + 2 * number >= size:
        return None
    (place,) = struct.unpack_from("<H", view, places + 4 + 2 * number)
    return table + place if place else None
