"""The header of a session: everything but the data of its control steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.reserved_keys import EVENT_WORDINGS
from pdtui.sessions.drive_info import DriveInfo, decode_drive_info
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, VERSIONS


@dataclass(frozen=True)
class SessionHeader:
    """A recorded drive without the data of its control steps.

    Attributes:
        path: the file.
        info: what was known before the first control step.
        versions: versions of the machine and the libraries that ran the drive.
        created: date and time at which the drive began, ISO 8601.
        events: the events, in the order in which they were applied.
        steps: number of control steps.
        endings: why episodes ended by themselves, by the control step that ended each.
        outcome: how the drive ended; empty if the recording was cut off.
    """

    path: Path
    info: DriveInfo
    versions: dict[str, str] = field(repr=False)
    created: str
    events: tuple[DriveEvent, ...] = field(repr=False)
    steps: int
    endings: dict[int, str] = field(repr=False)
    outcome: str = ""

    @property
    def seconds(self) -> float:
        """The simulated time, s."""
        return self.steps * self.info.dt

    @property
    def keys(self) -> int:
        """The number of key presses."""
        return sum(bool(event.key) for event in self.events)


def read_session_header(path: Path | str) -> SessionHeader:
    """Read the header of a session without decoding, or even reading, the data of its control steps.

    Raises:
        SessionError: the file does not exist, is no session, or is cut off or damaged; the message names the
            file. Damage within the data of control steps is not noticed.
    """
    path = Path(path)
    file = RrdContents(path, entities=(EVENTS, ENDINGS))
    try:
        return decode_header(file, path, file.skipped_rows[DRIVE])
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error


def decode_header(file: RrdContents, path: Path, steps: int) -> SessionHeader:
    """Return the header of a session of which properties, events and endings were read."""
    info, created = decode_drive_info(file.properties(INFO))
    versions = {name: str(values[0]) for name, values in file.properties(VERSIONS).items() if values}
    events, endings = _read_events(file.table(EVENTS)), _read_endings(file.table(ENDINGS))
    return SessionHeader(path, info, versions, created, events, steps, endings, read_drive_outcome(file))


def count_control_steps(drive: EntityTable) -> int:
    """Count control steps; one that is missing is a `SessionError`."""
    steps = drive.steps
    wrong = np.flatnonzero(steps != np.arange(len(steps)))
    if wrong.size:
        raise SessionError(f"expected control step {wrong[0]}, found step {steps[wrong[0]]}")
    return len(steps)


def _read_events(table: EntityTable) -> tuple[DriveEvent, ...]:
    if not len(table.steps):
        return ()
    numbers = table.read_numbers("number", np.int64)
    order = np.argsort(numbers, kind="stable")
    if not np.array_equal(numbers[order], np.arange(len(order))):
        raise SessionError("an event is missing")
    kinds, names, keys = table.read_texts("kind"), table.read_texts("name"), table.read_texts("key")
    values = table.read_numbers("value", np.float64)
    events = []
    for row in order:
        kind = kinds[row]
        if kind not in EVENT_WORDINGS:
            raise SessionError(f"unknown event '{kind[:40]}'; available: {', '.join(EVENT_WORDINGS)}")
        events.append(DriveEvent(int(table.steps[row]), kind, names[row], float(values[row]), keys[row]))
    return tuple(events)


def _read_endings(table: EntityTable) -> dict[int, str]:
    if not len(table.steps):
        return {}
    return dict(zip(table.steps.tolist(), table.read_texts("TextLog:text"), strict=True))


def read_drive_outcome(file: RrdContents) -> str:
    """Return how the drive ended; empty if the recording was cut off."""
    values = file.properties(OUTCOME).get("outcome", [])
    return values[0] if len(values) == 1 and isinstance(values[0], str) else ""
