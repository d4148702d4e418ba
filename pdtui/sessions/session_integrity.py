"""Examine how much of a session is whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import decode_drive_info
from pdtui.sessions.rrd.chunk_stream import RESCUE
from pdtui.sessions.rrd.end_index import read_end_index
from pdtui.sessions.rrd.file_check import check_file
from pdtui.sessions.rrd.message_reader import DamagedSpan
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.session_header_decoding import (
    find_gaps,
    read_drive_outcome,
    read_episode_endings,
    read_episode_outcomes,
    read_events,
    read_gaps,
)
from pdtui.sessions.session_header_index import decode_session_index
from pdtui.sessions.session_schema import (
    DIGEST_EPISODE,
    DRIVE,
    ENDINGS,
    EVENTS,
    INFO,
    OUTCOMES,
    REPAIR,
    VERSIONS,
)


@dataclass(frozen=True)
class SessionIntegrity:
    """How much of a session is whole.

    Attributes:
        header: what can be read of the session, apart from the data of its control steps.
        whole: whether nothing is damaged or missing, except for gaps that an earlier repair has reported.
        sealed: whether the messages have checksums; older sessions, and those that other tools wrote, do not.
        damage: the bytes that cannot be read.
        lost_events: number of events that are known to be missing.
        recording_id: identifier by which the viewer knows the recording; empty if it was not looked for.
    """

    header: SessionHeader
    whole: bool
    sealed: bool
    damage: tuple[DamagedSpan, ...] = ()
    lost_events: int = 0
    recording_id: str = ""

    @property
    def steps(self) -> int:
        """Number of control steps up to the last that can be read."""
        return self.header.steps

    @property
    def outcome(self) -> str:
        """How the drive ended; empty if the file does not say."""
        return self.header.outcome

    @property
    def verdict(self) -> str:
        """Whether the session is whole, in one line."""
        if self.whole:
            return (
                "whole, checksums match"
                if self.sealed
                else "no checksums, so that only a replay can check it"
            )
        if self.damage:
            first = self.damage[0]
            return f"not whole: byte {first.start}: {first.reason}; {RESCUE}"
        return f"not whole: its end is missing; {RESCUE}"

    def describe_losses(self) -> list[str]:
        """Say in words what a repair cannot rescue: control steps and events."""
        lines = [
            f"step {first} is missing" if end - first == 1 else f"steps {first} to {end - 1} are missing"
            for first, end in self.header.gaps
        ]
        if self.lost_events:
            what = "an event is" if self.lost_events == 1 else f"{self.lost_events} events are"
            lines.append(f"{what} missing, so a replay will differ")
        return lines


def examine_session(path: Path) -> SessionIntegrity:
    """Report what can be read of a session.

    A session whose checksums all match is not decoded. A file that is no session, or of which nothing can be
    rescued, is a `SessionError`.
    """
    check, index = check_file(path), read_end_index(path)
    if check.sealed and check.finished and not check.damage and index is not None:
        there = check.messages, check.checksum
        if (index.get("messages"), index.get("checksum")) == there:
            header = SessionHeader(path, **decode_session_index(index))
            return SessionIntegrity(header, whole=bool(header.outcome), sealed=True)
    return examine_session_by_decoding(path)


def examine_session_by_decoding(path: Path) -> SessionIntegrity:
    """Report what can be read of a session by decoding it, with the same errors as `examine_session`."""
    damage: list[DamagedSpan] = []
    file = RrdContents(path, only=(DIGEST_EPISODE,), damage=damage)
    index = _decode_end_index(path)
    try:
        declared = read_gaps(file)
        header, lost_events = _rescue_header(path, file, index, declared)
    except SessionError as error:
        raise SessionError(f"{path}: nothing can be rescued: {error}") from error
    known = header.gaps == declared and (not lost_events or bool(file.properties(REPAIR)))
    # A session with checksums was seen to be whole by them, or else something is wrong with its end.
    whole = file.finished and not damage and known and bool(header.outcome) and not file.sealed
    return SessionIntegrity(header, whole, file.sealed, tuple(damage), lost_events, file.recording_id)


def _decode_end_index(path: Path) -> dict[str, Any]:
    try:
        return decode_session_index(read_end_index(path) or {})
    except SessionError:
        return {}


def _rescue_header(
    path: Path, file: RrdContents, index: dict[str, Any], declared: Sequence[tuple[int, int]]
) -> tuple[SessionHeader, int]:
    """Return what can be read of a session, and the number of events that are known to be missing.

    The index and the gaps that an earlier repair has `declared` tell which last steps are missing.
    """
    properties = file.properties(INFO)
    info, created = (
        (index["info"], index["created"]) if index and not properties else decode_drive_info(properties)
    )
    versions = {name: str(values[0]) for name, values in file.properties(VERSIONS).items() if values}
    table = file.table(EVENTS)
    events = read_events(table, complete=False)
    last = int(table.read_numbers("number", np.int64).max()) if events else -1
    steps = file.table(DRIVE).steps
    total = max(0, *(steps[-1:] + 1).tolist(), index.get("steps", 0), *(end for _, end in declared))
    lost_events = last + 1 - len(events)
    if index:
        versions = versions or index["versions"]
        events, lost_events = index["events"], 0
    endings = read_episode_endings(file.table(ENDINGS))
    header = SessionHeader(
        path,
        info,
        versions,
        created,
        tuple(event for event in events if event.step < total),
        total,
        endings,
        read_drive_outcome(file) or index.get("outcome", ""),
        find_gaps(steps, total),
        read_episode_outcomes(file.table(OUTCOMES), endings),
    )
    return header, lost_events
