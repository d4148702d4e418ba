"""The header of a session: everything but the data of its control steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.rrd.end_index import read_end_index
from pdtui.sessions.session_header_index import decode_session_index


@dataclass(frozen=True)
class SessionHeader:
    """A recorded drive without the data of its control steps.

    Attributes:
        path: the file.
        info: what was known before the first control step.
        versions: versions of the machine and the libraries that ran the drive.
        created: date and time at which the drive began, ISO 8601.
        events: the events, in the order in which they were applied.
        steps: number of control steps, including those that are missing.
        endings: why episodes ended by themselves, by the control step that ended each.
        outcome: how the drive ended; empty if the recording was cut off.
        gaps: ranges of control steps that a repair could not rescue, each without its end; the events of a
            session with gaps may be incomplete.
        outcomes: how episodes ended, or that their task was done and they went on, by the control step. In
            a session that is older than these words, they are taken from `endings`, where those tell.
    """

    path: Path
    info: DriveInfo
    versions: dict[str, str] = field(repr=False)
    created: str
    events: tuple[DriveEvent, ...] = field(repr=False)
    steps: int
    endings: dict[int, str] = field(repr=False)
    outcome: str = ""
    gaps: tuple[tuple[int, int], ...] = ()
    outcomes: dict[int, Outcome] = field(default_factory=dict, repr=False)

    @property
    def outcome_counts(self) -> OutcomeCounts:
        """How often each outcome came about."""
        return count_outcomes(self.outcomes.values())

    @property
    def missing(self) -> int:
        """The number of control steps that a repair could not rescue."""
        return count_missing(self.gaps)

    @property
    def seconds(self) -> float:
        """The simulated time, s."""
        return self.steps * self.info.dt

    @property
    def keys(self) -> int:
        """The number of key presses."""
        return sum(bool(event.key) for event in self.events)


def read_session_header(path: Path | str) -> SessionHeader:
    """Read the header of a session from the index at its end, or without decoding the data of its steps.

    Raises:
        SessionError: the file does not exist, is no session, or is cut off or damaged; the message names the
            file. Damage within the data of control steps is not noticed, and none is in a file with an index.
    """
    path = Path(path)
    index = read_end_index(path)
    if index is not None:
        try:
            return SessionHeader(path, **decode_session_index(index))
        except SessionError:
            pass  # the file itself says the same, or what is wrong
    # What a session with an index does without takes longer to load than the index takes to read.
    from pdtui.sessions.session_header_decoding import scan_session_header

    return scan_session_header(path)


def count_missing(gaps: Sequence[tuple[int, int]]) -> int:
    """Return the number of control steps in gaps."""
    return sum(end - first for first, end in gaps)
