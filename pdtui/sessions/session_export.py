"""Export streams of a session as Parquet or CSV tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import SessionError
from pdtui.core.units import format_unit
from pdtui.sessions.session_header import SessionHeader, read_session_header
from pdtui.sessions.session_reader import require_activations
from pdtui.sessions.session_schema import ACTIVE_FIELDS
from pdtui.sessions.streams.step_block import StepBlock, empty_step_block
from pdtui.sessions.streams.step_block_reader import read_step_blocks

Columns = dict[str, Any]
_SUFFIXES = (".parquet", ".csv")
_BLOCK_STEPS = 4096
"""Control steps that are written at once: a row group of a Parquet file, which is slow to read if small."""


@dataclass(frozen=True)
class ExportStream:
    """A stream that can be exported.

    Attributes:
        says: what it contains.
        columns: returns its columns in a block of control steps, with ``step`` if a step may have any number
            of rows; None for the events, which do not come in blocks.
        activations: whether the block has to contain activations.
    """

    says: str
    columns: Callable[[StepBlock, SessionHeader], Columns] | None
    activations: bool = False


def export_stream(path: Path, stream: str, output: Path, *, overwrite: bool = False) -> int:
    """Write one stream of a session as a table with the columns ``step``, ``time`` (s) and its own.

    Args:
        path: the session.
        stream: name of one of `STREAMS`.
        output: the .parquet or .csv file.
        overwrite: whether an existing file is replaced.

    Returns:
        The number of rows.

    Raises:
        SessionError: the session cannot be read, there is no such stream, or the output cannot be written.
    """
    if stream not in STREAMS:
        raise SessionError(f"no stream '{stream[:40]}'; available: {', '.join(STREAMS)}")
    if output.suffix not in _SUFFIXES:
        raise SessionError(f"{output}: expected a name that ends with {' or '.join(_SUFFIXES)}")
    if output.exists() and not overwrite:
        raise SessionError(f"{output}: already exists; --overwrite replaces it")
    header = read_session_header(path)
    if STREAMS[stream].activations:
        require_activations(header)
    tables = _read_tables(STREAMS[stream], header)
    rows = 0
    try:
        with replace_file(output, SessionError) as partial:
            first = next(tables)
            with _open_writer(partial, output.suffix, first.schema) as writer:
                for table in chain([first], tables):
                    writer.write_table(table)
                    rows += table.num_rows
    except pa.ArrowException as error:
        raise SessionError(f"{output}: cannot be written: {error}") from error
    return rows


def _read_tables(stream: ExportStream, header: SessionHeader) -> Iterator[pa.Table]:
    """Yield the rows of each block of control steps; a session without any has an empty table."""
    if stream.columns is None:
        yield _event_table(header)
        return
    blocks = read_step_blocks(header, activations=stream.activations, block_steps=_BLOCK_STEPS)
    for block in chain([next(blocks, None) or empty_step_block(header.info)], blocks):
        columns = stream.columns(block, header)
        steps = np.asarray(columns.pop("step", block.steps), np.int64)
        yield pa.table({"step": steps, "time": steps * header.info.dt, **columns})


def _open_writer(path: Path, suffix: str, schema: pa.Schema) -> Any:
    if suffix == ".csv":
        return pyarrow.csv.CSVWriter(str(path), schema)
    return pyarrow.parquet.ParquetWriter(str(path), schema)


def _attribute_columns(block: StepBlock, header: SessionHeader) -> Columns:
    names = [f"{attribute.name} ({attribute.unit})" for attribute in header.info.attributes]
    return _name_columns(block.attributes, names)


def _action_columns(block: StepBlock, _: SessionHeader) -> Columns:
    actions = block.actions_as_float32()
    return _name_columns(actions, [f"action {index}" for index in range(actions.shape[1])])


def _reward_columns(block: StepBlock, _: SessionHeader) -> Columns:
    ended = [block.endings.get(step, "") for step in block.steps.tolist()]
    outcomes = [str(block.outcomes.get(step, "")) for step in block.steps.tolist()]
    return {
        "reward": block.rewards,
        "cost": block.costs,
        "episode": block.episodes,
        "ended": pa.array(ended, pa.utf8()),
        "outcome": pa.array(outcomes, pa.utf8()),
    }


def _digest_columns(block: StepBlock, _: SessionHeader) -> Columns:
    return {"digest": block.digests}


def _activation_columns(block: StepBlock, header: SessionHeader) -> Columns:
    layers = header.info.layers
    names = [format_unit(unit, layers) for unit in range(sum(layers))]
    assert block.activations is not None
    return _name_columns(block.activations.astype(np.float32, copy=False), names)


def _behavior_columns(block: StepBlock, _: SessionHeader) -> Columns:
    columns: Columns = {
        "step": np.repeat(block.steps, block.behavior_counts),
        "behavior": pa.array(block.behavior_names, pa.utf8()),
    }
    for column, field in enumerate(ACTIVE_FIELDS):
        # NaN stands for None.
        columns[field] = pa.array(block.behavior_states[:, column], pa.float64(), from_pandas=True)
    return columns


def _unit_columns(block: StepBlock, header: SessionHeader) -> Columns:
    units = [format_unit(int(unit), header.info.layers) for unit in block.stimulated[:, 0]]
    return {
        "step": np.repeat(block.steps, block.stimulated_counts),
        "unit": pa.array(units, pa.utf8()),
        "overwritten": block.stimulated[:, 1],
        "natural": block.stimulated[:, 2],
    }


def _takeover_columns(block: StepBlock, _: SessionHeader) -> Columns:
    rows, components = block.replaced_row_indices, block.replaced[:, 0].astype(np.int64)
    return {
        "step": block.steps[rows],
        "action": components,
        "operator": block.actions_as_float32()[rows, components],
        "policy": block.replaced[:, 1],
    }


def _event_table(header: SessionHeader) -> pa.Table:
    steps = np.array([event.step for event in header.events], np.int64)
    columns: Columns = {"step": steps, "time": steps * header.info.dt}
    kinds = {"kind": pa.utf8(), "name": pa.utf8(), "value": pa.float64(), "key": pa.utf8()}
    for field, kind in kinds.items():
        columns[field] = pa.array([getattr(event, field) for event in header.events], kind)
    return pa.table(columns)


def _name_columns(block: NDArray[Any], names: list[str]) -> Columns:
    return {name: block[:, column] for column, name in enumerate(names)}


STREAMS: dict[str, ExportStream] = {
    "attributes": ExportStream("kinematic attributes after each step", _attribute_columns),
    "actions": ExportStream("what the policy, or during a takeover the operator, commanded", _action_columns),
    "gains": ExportStream("reward, cost, episode, and why and how it ended", _reward_columns),
    "digests": ExportStream("digest of the simulator's state after each step", _digest_columns),
    "activations": ExportStream(
        "output of every hidden unit, as the next layer received it", _activation_columns, activations=True
    ),
    "behaviors": ExportStream("active behaviors with their controllers, one row each", _behavior_columns),
    "stimulation": ExportStream(
        "stimulated units, with natural and overwritten outputs, one row each", _unit_columns
    ),
    "takeover": ExportStream(
        "components of the action that the operator set, with the policy's own value, one row each",
        _takeover_columns,
    ),
    "events": ExportStream("everything that changed the run, one row per event", None),
}
"""The streams by name."""
