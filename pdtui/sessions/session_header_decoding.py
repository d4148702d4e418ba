"""Put the header of a session together from its messages: description, events, endings, outcome and gaps."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.outcome import Outcome
from pdtui.sessions.drive_info import decode_drive_info
from pdtui.sessions.recorded_outcomes import decode_outcomes
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_header import SessionHeader, count_missing
from pdtui.sessions.session_header_index import decode_event, decode_gaps
from pdtui.sessions.session_schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, OUTCOMES, REPAIR, VERSIONS
from pdtui.sessions.streams.step_numbers import number_steps


def scan_session_header(path: Path) -> SessionHeader:
    """Read the header of a session without its index, from the heads of all messages.

    Raises:
        SessionError: as `read_session_header`.
    """
    file = RrdContents(path, entities=(EVENTS, ENDINGS, OUTCOMES))
    try:
        return decode_session_header(file, path, file.skipped_rows[DRIVE])
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error


def decode_session_header(file: RrdContents, path: Path, rows: int) -> SessionHeader:
    """Return the header of a session of which properties, events, endings and outcomes were read.

    `rows` is the number of control steps that are there.
    """
    info, created = decode_drive_info(file.properties(INFO))
    versions = {name: str(values[0]) for name, values in file.properties(VERSIONS).items() if values}
    gaps = read_gaps(file)
    events = read_events(file.table(EVENTS), complete=not file.properties(REPAIR))
    endings, outcome = read_episode_endings(file.table(ENDINGS)), read_drive_outcome(file)
    outcomes = read_episode_outcomes(file.table(OUTCOMES), endings)
    steps = rows + count_missing(gaps)
    return SessionHeader(path, info, versions, created, events, steps, endings, outcome, gaps, outcomes)


def find_gaps(steps: NDArray[np.int64], total: int = 0) -> tuple[tuple[int, int], ...]:
    """Return the ranges of control steps that are missing before, between and after these.

    The steps are in order; `total` is the number of steps that there were, if it is known.
    """
    before, after = np.concatenate([[-1], steps]), np.concatenate([steps, [total]])
    places = np.flatnonzero(after - before > 1)
    return tuple((int(before[place]) + 1, int(after[place])) for place in places)


def count_control_steps(drive: EntityTable, gaps: Sequence[tuple[int, int]] = ()) -> int:
    """Count the control steps that are there; one that is missing, except in gaps, is a `SessionError`."""
    steps = drive.steps
    expected = number_steps(0, len(steps), gaps)
    wrong = np.flatnonzero(steps != expected)
    if wrong.size:
        raise SessionError(f"expected control step {expected[wrong[0]]}, found step {steps[wrong[0]]}")
    return len(steps)


def read_gaps(file: RrdContents) -> tuple[tuple[int, int], ...]:
    """Return the ranges of control steps that a repair could not rescue."""
    text = file.properties(REPAIR).get("gaps", ["[]"])
    try:
        return decode_gaps(json.loads(text[0]))
    except (ValueError, TypeError, IndexError, RecursionError) as error:
        raise SessionError(f"property 'gaps': invalid: {error!r}") from error


def read_events(table: EntityTable, *, complete: bool = True) -> tuple[DriveEvent, ...]:
    """Return the events in their order; a missing one is a `SessionError` if they have to be `complete`."""
    if not len(table.steps):
        return ()
    numbers = table.read_numbers("number", np.int64)
    order = np.argsort(numbers, kind="stable")
    if complete and not np.array_equal(numbers[order], np.arange(len(order))):
        raise SessionError("an event is missing")
    kinds, names, keys = table.read_texts("kind"), table.read_texts("name"), table.read_texts("key")
    values = table.read_numbers("value", np.float64)
    try:
        return tuple(
            decode_event(int(table.steps[row]), kinds[row], names[row], float(values[row]), keys[row])
            for row in order
        )
    except ValueError as error:
        raise SessionError(f"an event is damaged: {error}") from error


def read_episode_endings(table: EntityTable) -> dict[int, str]:
    if not len(table.steps):
        return {}
    return dict(zip(table.steps.tolist(), table.read_texts("TextLog:text"), strict=True))


def read_episode_outcomes(table: EntityTable, endings: Mapping[int, str]) -> dict[int, Outcome]:
    """Return the outcomes of episodes by control step; a word that is none is a `SessionError`."""
    words = table.read_texts("outcome") if len(table.steps) else []
    try:
        return decode_outcomes(zip(table.steps.tolist(), words, strict=True), endings)
    except ValueError as error:
        raise SessionError(f"stream '{OUTCOMES}/outcome': {error}") from error


def read_drive_outcome(file: RrdContents) -> str:
    """Return how the drive ended; empty if the recording was cut off."""
    values = file.properties(OUTCOME).get("outcome", [])
    return values[0] if len(values) == 1 and isinstance(values[0], str) else ""
