"""Export streams of a session as tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import SessionError
from pdtui.sessions.export.export_streams import (
    STREAMS,
    Columns,
    ExportColumn,
    event_columns,
    observation_columns,
)
from pdtui.sessions.export.table_writers import choose_export_format, concatenate_streams, open_table_file
from pdtui.sessions.session_header import SessionHeader, read_session_header
from pdtui.sessions.session_reader import require_activations
from pdtui.sessions.session_schema import ExportFormat
from pdtui.sessions.streams.step_block import empty_step_block
from pdtui.sessions.streams.step_block_reader import read_step_blocks

ReplayObservations = Callable[[SessionHeader], Iterator[tuple[NDArray[np.int64], NDArray[Any]]]]
"""Computes the observations of a session again: the steps of a block, shape (n,), and what the policy
observed before them, shape (n, O)."""

_BLOCK_STEPS = 4096
"""Control steps that are written at once: a row group of a Parquet file, which is slow to read if small."""


def export_stream(
    path: Path,
    stream: str,
    output: Path,
    *,
    form: str | None = None,
    overwrite: bool = False,
    observe: ReplayObservations | None = None,
) -> int:
    """Write one stream of a session as a table with the columns ``step``, ``time`` (s) and its own.

    Each column of a Parquet file says its ``unit`` and its ``description`` in its field's metadata, and the
    table which session it is of. Values that are not there are null.

    Args:
        path: the session.
        stream: name of one of `STREAMS`.
        output: the file.
        form: one of `EXPORT_FORMATS`; by default that of the file's name.
        overwrite: whether an existing file is replaced.
        observe: computes the observations, which a session does not contain.

    Returns:
        The number of rows.

    Raises:
        SessionError: the session cannot be read, there is no such stream, or the output cannot be written.
    """
    if stream not in STREAMS:
        raise SessionError(f"no stream '{stream[:40]}'; available: {', '.join(STREAMS)}")
    kind = choose_export_format(output, form)
    _refuse_existing([output], overwrite)
    header = read_session_header(path)
    if STREAMS[stream].activations:
        require_activations(header)
    return _write_file(output, kind, header, [stream], observe)[stream]


def export_all_streams(
    path: Path,
    output: Path,
    *,
    form: str | None = None,
    overwrite: bool = False,
    observe: ReplayObservations | None = None,
) -> dict[str, int]:
    """Write all streams that a session has: into one MCAP file, or as tables of their names into a folder.

    Args:
        path: the session.
        output: the MCAP file or the folder.
        form: one of `EXPORT_FORMATS`; by default that of the name, or Parquet.
        overwrite: whether existing files are replaced.
        observe: computes the observations; without it, they are left out.

    Returns:
        The number of rows of each stream.

    Raises:
        SessionError: the session cannot be read, or the output cannot be written.
    """
    kind = choose_export_format(output, form or ("mcap" if output.suffix == ".mcap" else "parquet"))
    header = read_session_header(path)
    absent = {
        *(["activations"] if header.info.activations == "off" else []),
        *(["observations"] if observe is None else []),
    }
    names = [name for name in STREAMS if name not in absent]
    files = {output / f"{name}.{kind}": [name] for name in names} if kind != "mcap" else {output: names}
    _refuse_existing(files, overwrite)
    rows: dict[str, int] = {}
    for file, streams in files.items():
        rows |= _write_file(file, kind, header, streams, observe)
    return rows


def _refuse_existing(files: Iterable[Path], overwrite: bool) -> None:
    for file in files:
        if file.exists() and not overwrite:
            raise SessionError(f"{file}: already exists; --overwrite replaces it")


def _write_file(
    output: Path,
    kind: ExportFormat,
    header: SessionHeader,
    streams: list[str],
    observe: ReplayObservations | None,
) -> dict[str, int]:
    tables = ((name, table) for name in streams for table in _read_tables(name, header, observe))
    try:
        with replace_file(output, SessionError) as partial, open_table_file(partial, kind) as write:
            return concatenate_streams(tables, write)
    except pa.ArrowException as error:
        raise SessionError(f"{output}: cannot be written: {error}") from error


def _read_tables(name: str, header: SessionHeader, observe: ReplayObservations | None) -> Iterator[pa.Table]:
    """Yield the rows of each block of control steps; a session without any has an empty table."""
    stream = STREAMS[name]
    if name == "events":
        yield _make_table(event_columns(header), None, header)
        return
    if name == "observations":
        if observe is None:
            raise SessionError(f"{header.path}: the observations are not recorded; a replay computes them")
        for steps, observations in observe(header):
            yield _make_table(observation_columns(observations), steps, header)
        return
    assert stream.columns is not None
    blocks = read_step_blocks(
        header, activations=stream.activations, poses=stream.poses, block_steps=_BLOCK_STEPS
    )
    for block in chain([next(blocks, None) or empty_step_block(header.info)], blocks):
        yield _make_table(stream.columns(block, header), block.steps, header)


def _make_table(columns: Columns, steps: Any, header: SessionHeader) -> pa.Table:
    """Return a table that says in its metadata what it is of, and in that of its fields what they are."""
    given = columns.pop("step", ExportColumn(steps))
    numbers = np.asarray(given.values, np.int64)
    whole = {
        "step": ExportColumn(numbers, "control steps", "number of the control step, from 0"),
        "time": ExportColumn(numbers * header.info.dt, "s", "simulated time at which the step starts"),
        **columns,
    }
    arrays = [
        column.values if isinstance(column.values, pa.Array) else pa.array(column.values)
        for column in whole.values()
    ]
    fields = [
        pa.field(name, array.type, metadata={"unit": column.unit, "description": column.says})
        for (name, column), array in zip(whole.items(), arrays, strict=True)
    ]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=_describe_session(header)))


def _describe_session(header: SessionHeader) -> dict[str, str]:
    info = header.info
    return {
        "session": header.path.name,
        "created": header.created,
        "robot": info.robot,
        "robot_options": json.dumps(dict(info.robot_options)),
        "policy": info.policy,
        "policy_sha256": info.policy_hash,
        "seed": str(info.seed),
        "seconds_per_step": repr(info.dt),
        "outcome": header.outcome,
    }
