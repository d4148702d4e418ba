"""Write tables into files of several formats: Parquet, CSV and MCAP."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from pdtui.core.errors import SessionError
from pdtui.core.printable_text import to_json
from pdtui.sessions.session_schema import EXPORT_FORMATS, ExportFormat

WriteTable = Callable[[str, pa.Table], None]
_JSON_TYPES = {"int64": "integer", "float": "number", "double": "number", "string": "string"}


def choose_export_format(output: Path, wanted: str | None) -> ExportFormat:
    """Return the wanted format, or the one of the name of a file; a `SessionError` if it is none of them."""
    found = wanted or output.suffix.removeprefix(".")
    for known in EXPORT_FORMATS:
        if found == known:
            return known
    suffixes = ", ".join(f".{one}" for one in EXPORT_FORMATS)
    raise SessionError(f"{output}: expected a name that ends with one of {suffixes}")


@contextmanager
def open_table_file(path: Path, kind: ExportFormat) -> Iterator[WriteTable]:
    """Yield a function that adds a table to a file, by the name of its stream.

    A Parquet or a CSV file has one stream, whose tables have the same columns; an MCAP file any number.

    Raises:
        SessionError: the library for the format is not installed.
    """
    if kind == "mcap":
        with _open_mcap_file(path) as write:
            yield write
        return
    writer: Any = None

    def write_table(_: str, table: pa.Table) -> None:
        nonlocal writer
        if writer is None:
            kinds = {"csv": pyarrow.csv.CSVWriter, "parquet": pyarrow.parquet.ParquetWriter}
            writer = kinds[kind](str(path), table.schema)
        writer.write_table(table)

    try:
        yield write_table
    finally:
        if writer is not None:
            writer.close()


@contextmanager
def _open_mcap_file(path: Path) -> Iterator[WriteTable]:
    """Write each stream as a channel of JSON messages with a JSON schema, at the time of its control step."""
    try:
        from mcap.writer import Writer
    except ImportError as error:
        raise SessionError(
            "MCAP needs a package that is not installed: pip install 'pdtui[export]'"
        ) from error
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="pdtui")
        channels: dict[str, int] = {}

        def write_table(stream: str, table: pa.Table) -> None:
            if stream not in channels:
                if not channels:
                    writer.add_metadata("session", _as_texts(table.schema.metadata))
                schema = json.dumps(_json_schema(stream, table.schema)).encode()
                number = writer.register_schema(f"pdtui.{stream}", "jsonschema", schema)
                channels[stream] = writer.register_channel(f"/{stream}", "json", number)
            nanoseconds = np.rint(table.column("time").to_numpy() * 1e9).astype(np.int64).tolist()
            for at, row in zip(nanoseconds, table.to_pylist(), strict=True):
                data = to_json(row, indent=None).encode()
                writer.add_message(channels[stream], log_time=at, publish_time=at, data=data)

        yield write_table
        writer.finish()  # type: ignore[no-untyped-call]


def _json_schema(stream: str, schema: pa.Schema) -> dict[str, Any]:
    properties: dict[str, Any] = {}
    for field in schema:
        kinds = [_JSON_TYPES[str(field.type)], "null"]
        properties[field.name] = {"type": kinds, **_as_texts(field.metadata)}
    return {"title": stream, "type": "object", "properties": properties}


def _as_texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in (metadata or {}).items()}


def concatenate_streams(tables: Iterable[tuple[str, pa.Table]], write: WriteTable) -> dict[str, int]:
    """Write tables, and return the number of rows of each stream."""
    rows: dict[str, int] = {}
    for stream, table in tables:
        write(stream, table)
        rows[stream] = rows.get(stream, 0) + table.num_rows
    return rows
