"""Export streams of a session as Parquet or CSV tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import SessionError
from pdtui.core.units import format_unit
from pdtui.sessions.session_reader import Session, read_activations, read_session
from pdtui.sessions.session_schema import ACTIVE_FIELDS

Columns = dict[str, Any]
_WRITERS: dict[str, Callable[[pa.Table, str], None]] = {
    ".parquet": pyarrow.parquet.write_table,
    ".csv": pyarrow.csv.write_csv,
}


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
    if output.suffix not in _WRITERS:
        raise SessionError(f"{output}: expected a name that ends with {' or '.join(_WRITERS)}")
    if output.exists() and not overwrite:
        raise SessionError(f"{output}: already exists; --overwrite replaces it")
    session = read_session(path)
    columns = STREAMS[stream][1](session)
    steps = np.asarray(columns.pop("step", np.arange(session.steps)), np.int64)
    table = pa.table({"step": steps, "time": steps * session.info.dt, **columns})
    try:
        with replace_file(output, SessionError) as partial:
            _WRITERS[output.suffix](table, str(partial))
    except pa.ArrowException as error:
        raise SessionError(f"{output}: cannot be written: {error}") from error
    return int(table.num_rows)


def _attribute_columns(session: Session) -> Columns:
    names = [f"{attribute.name} ({attribute.unit})" for attribute in session.info.attributes]
    return _name_columns(session.attributes, names)


def _action_columns(session: Session) -> Columns:
    return _name_columns(session.actions, [f"action {index}" for index in range(session.actions.shape[1])])


def _reward_columns(session: Session) -> Columns:
    return {
        "reward": session.rewards,
        "cost": session.costs,
        "episode": session.episodes,
        "ended": [session.endings.get(step, "") for step in range(session.steps)],
    }


def _activation_columns(session: Session) -> Columns:
    activations = read_activations(session.path)
    units = [format_unit(unit, session.info.layers) for unit in range(activations.shape[1])]
    return _name_columns(activations, units)


def _behavior_columns(session: Session) -> Columns:
    rows = [(step, view) for step, views in enumerate(session.active) for view in views]
    columns: Columns = {"step": [step for step, _ in rows], "behavior": [view.name for _, view in rows]}
    for field in ACTIVE_FIELDS:
        columns[field] = pa.array([getattr(view, field) for _, view in rows], pa.float64())
    return columns


def _unit_columns(session: Session) -> Columns:
    rows = [
        (step, format_unit(unit, session.info.layers), value, natural)
        for step, (stimulation, outputs) in enumerate(zip(session.stimulations, session.natural, strict=True))
        for unit, value, natural in zip(stimulation.units, stimulation.values, outputs, strict=True)
    ]
    steps, units, values, natural = zip(*rows, strict=True) if rows else ((), (), (), ())
    return {
        "step": steps,
        "unit": pa.array(units, pa.utf8()),
        "overwritten": pa.array(values, pa.float64()),
        "natural": pa.array(natural, pa.float64()),
    }


def _event_columns(session: Session) -> Columns:
    columns: Columns = {"step": [event.step for event in session.events]}
    kinds = {"kind": pa.utf8(), "name": pa.utf8(), "value": pa.float64(), "key": pa.utf8()}
    for field, kind in kinds.items():
        columns[field] = pa.array([getattr(event, field) for event in session.events], kind)
    return columns


def _name_columns(block: np.ndarray[Any, Any], names: list[str]) -> Columns:
    return {name: block[:, column] for column, name in enumerate(names)}


STREAMS: dict[str, tuple[str, Callable[[Session], Columns]]] = {
    "attributes": ("kinematic attributes after each step", _attribute_columns),
    "actions": ("what the policy commanded", _action_columns),
    "gains": ("reward, cost, episode, and why it ended", _reward_columns),
    "digests": ("digest of the simulator's state after each step", lambda one: {"digest": one.digests}),
    "activations": ("output of every hidden unit, as the next layer received it", _activation_columns),
    "behaviors": ("active behaviors with their controllers, one row each", _behavior_columns),
    "stimulation": ("stimulated units, with natural and overwritten outputs, one row each", _unit_columns),
    "events": ("everything that changed the run, one row per event", _event_columns),
}
"""The streams by name: what each contains, and the function that returns its columns."""
