"""What is known of a session without reading what every step held: enough to list it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pdtui.core.errors import SessionError
from pdtui.core.events import Event
from pdtui.core.key_table import EVENT_WORDINGS
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.drive_info_codec import decode_drive_info
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, VERSIONS


@dataclass(frozen=True)
class SessionHeader:
    """A recorded drive without its numbers.

    Attributes:
        path: the file.
        info: what determines the run, besides its events.
        versions: of machine and libraries that ran it.
        created: date and time, ISO 8601.
        events: in the order in which they were applied.
        steps: number of control steps.
        endings: why an episode ended by itself, by the step with which it did.
        outcome: how the drive ended; empty if the file has no end.
    """

    path: Path
    info: DriveInfo
    versions: dict[str, str] = field(repr=False)
    created: str
    events: tuple[Event, ...] = field(repr=False)
    steps: int
    endings: dict[int, str] = field(repr=False)
    outcome: str = ""

    @property
    def seconds(self) -> float:
        """Simulated time, s."""
        return self.steps * self.info.dt

    @property
    def keys(self) -> int:
        """Keys pressed."""
        return sum(bool(event.key) for event in self.events)


def read_session_header(path: Path | str) -> SessionHeader:
    """Read the header of a session without decoding, or even reading, the data of its control steps.

    Raises:
        SessionError: no such file, not a session, torn, or incomplete; the message names the file. Damage
            within the data of control steps is not noticed.
    """
    path = Path(path)
    file = RrdContents(path, entities=(EVENTS, ENDINGS))
    try:
        return decode_header(file, path, file.skipped_rows[DRIVE])
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error


def decode_header(file: RrdContents, path: Path, steps: int) -> SessionHeader:
    """Return the header of a session of which properties, events and endings were read.

    Raises:
        SessionError: a part is missing or not what it should be; the message does not name the file.
    """
    info, created = decode_drive_info(file.properties(INFO))
    return SessionHeader(
        path=path,
        info=info,
        versions={name: str(values[0]) for name, values in file.properties(VERSIONS).items() if values},
        created=created,
        events=_events(file.rows(EVENTS)),
        steps=steps,
        endings=_endings(file.rows(ENDINGS)),
        outcome=_outcome(file),
    )


def count_steps(drive: EntityTable) -> int:
    """How many there are, none missing.

    Raises:
        SessionError: a step is missing.
    """
    steps = drive.steps
    wrong = np.flatnonzero(steps != np.arange(len(steps)))
    if wrong.size:
        raise SessionError(f"expected control step {wrong[0]}, found step {steps[wrong[0]]}")
    return len(steps)


def _events(found: EntityTable) -> tuple[Event, ...]:
    if not len(found.steps):
        return ()
    order = np.argsort(found.numbers("number", np.int64), kind="stable")
    if not np.array_equal(found.numbers("number", np.int64)[order], np.arange(len(order))):
        raise SessionError("an event is missing")
    kinds, names, keys = found.texts("kind"), found.texts("name"), found.texts("key")
    values = found.numbers("value", np.float64)
    events = []
    for row in order:
        kind = kinds[row]
        if kind not in EVENT_WORDINGS:
            raise SessionError(f"unknown event '{kind[:40]}'; there are {', '.join(EVENT_WORDINGS)}")
        events.append(Event(int(found.steps[row]), kind, names[row], float(values[row]), keys[row]))
    return tuple(events)


def _endings(found: EntityTable) -> dict[int, str]:
    if not len(found.steps):
        return {}
    return dict(zip(found.steps.tolist(), found.texts("TextLog:text"), strict=True))


def _outcome(file: RrdContents) -> str:
    values = file.properties(OUTCOME).get("outcome", [])
    return values[0] if len(values) == 1 and isinstance(values[0], str) else ""
