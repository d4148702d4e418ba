"""Record a session during a drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import RecordingEnded, SessionError
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.sessions.drive_info import DriveInfo, encode_drive_info
from pdtui.sessions.environment_versions import collect_versions
from pdtui.sessions.session_header_index import build_session_index
from pdtui.sessions.session_schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, OUTCOMES, VERSIONS
from pdtui.sessions.session_summary import SessionSummaryCounter
from pdtui.sessions.viewer.session_blueprint import session_blueprint
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.viewer.viewer_data_writer import ViewerDataWriter
from pdtui.sessions.writer.disk_space import DiskReserve
from pdtui.sessions.writer.session_file import ExistingFile, SessionFile, SyncMode
from pdtui.sessions.writer.session_outputs import SessionOutputs
from pdtui.sessions.writer.step_record_columns import (
    count_records,
    episode_end_columns,
    event_columns,
    outcome_columns,
    step_record_columns,
)

_VIEW_ROWS, _LIVE_ROWS = 128, 8
_SAFE_ROWS = 16
"""Batches of up to this many control steps are waited for, which takes 0.5 ms or more per batch."""

_BATCHES_ON_THEIR_WAY = 8
"""Number of larger batches that are not waited for; a slow disk must not fill the memory."""

_DESCRIBED_AGAIN = 50
"""After so many control steps, the description of the drive is written a second time."""


class SessionRecorder:
    """Writes control steps to a Rerun recording, in batches.

    The file is created with the first control step, so that a drive which ends while it starts leaves none.
    Steps with events and steps that end an episode are written at once, with all steps before them. With
    small batches, `write` returns when the batch was handed to the operating system: SIGKILL loses at most
    the last `rows_per_write` − 1 steps, and the file can be read without its end. With large batches, which
    are meant for drives faster than real time, `write` does not wait for the thread that writes.

    The space on the disk is checked before each batch. Once only the end of the recording still fits, the
    recording is closed properly and `RecordingEnded` is raised. If a write fails nevertheless, as on a disk
    that others fill, the file ends after its last complete message, so that it can be read up to there.

    Args:
        path: the file; its folder is created.
        info: the drive.
        rows_per_write: control steps per batch. Small batches lose less in a crash; large ones cost less.
        view_rows: control steps per batch of data that only the viewer draws.
        viewer: address of a viewer that shows the drive live; None for none.
        existing: what to do if a file of this name exists. With ``replace``, the recording is written beside
            it, and replaces it once it is closed whole.
        sync: when data are forced to the disk.
        versions: what the drive runs on; by default, what this process does.

    Attributes:
        notice: one line on what happened to the file while it was written, such as that it was renamed; empty
            if nothing did.

    Raises:
        SessionError: the file exists or cannot be written, or the disk is full.
    """

    def __init__(
        self,
        path: Path,
        info: DriveInfo,
        *,
        rows_per_write: int = 128,
        view_rows: int = _VIEW_ROWS,
        viewer: ViewerAddress | None = None,
        existing: ExistingFile = "refuse",
        sync: SyncMode = "batch",
        versions: Mapping[str, str] | None = None,
    ) -> None:
        self.info = info
        self._created = datetime.now(UTC).isoformat(timespec="seconds")
        self._versions = versions or collect_versions()
        self._rows_per_write = max(1, rows_per_write)
        self._rows: list[StepRecord] = []
        self._viewer_rows = max(view_rows if viewer is None else _LIVE_ROWS, 2 * self._rows_per_write)
        self._waits_for_batches = self._rows_per_write <= _SAFE_ROWS
        self._steps = self._batches = 0
        self._summary = SessionSummaryCounter(info)
        self._events: list[DriveEvent] = []
        self._endings: dict[int, str] = {}
        self._episode_outcomes: dict[int, Outcome] = {}
        self._closed = self._failed = False
        self.notice = ""
        batches = 1 if self._waits_for_batches else _BATCHES_ON_THEIR_WAY
        file = SessionFile(Path(path), existing, sync)
        self._reserve = DiskReserve(sum(info.layers), self._viewer_rows + batches * self._rows_per_write)
        self._reserve.require_space_to_begin(file.path)
        self._outputs = SessionOutputs(file, info, self._created, viewer)
        self._recording = self._outputs.recording
        self._describe_drive()
        self._viewer_data = ViewerDataWriter(info, self._outputs.send_columns, self._outputs.log_static)
        self._flush_rows()

    @property
    def path(self) -> Path:
        """Where the file is, or will be once the first control step is written."""
        return self._recording.path

    @property
    def bytes(self) -> int:
        """The size of the file so far, bytes."""
        return self._recording.size

    @property
    def created(self) -> str:
        """Date and time at which the drive began, ISO 8601."""
        return self._created

    @property
    def on_disk(self) -> bool:
        """Whether there is a file: not before the first control step."""
        return self._recording.on_disk

    def write(self, record: StepRecord) -> None:
        """Record one control step. The recorder keeps its arrays, which must not be changed.

        Raises:
            RecordingEnded: the disk is full; the recording was closed with this step as its last.
            SessionError: the file cannot be written, or the recorder is closed.
        """
        if self._closed:
            raise SessionError(f"{self.path}: the session is closed")
        self._rows.append(record)
        self._steps += 1
        if record.events or record.ended or record.outcome:
            self._require_space()
            self.flush()
        elif len(self._rows) >= self._rows_per_write:
            self._require_space()
            self._write_rows()
            self._batches += 1
            self._flush_rows(wait=self._waits_for_batches or self._batches % _BATCHES_ON_THEIR_WAY == 0)

    def flush(self) -> None:
        """Write all steps so far and wait until they were handed to the operating system."""
        self._write_rows()
        self._flush_rows()

    def close(self, outcome: str) -> None:
        """Write the rest, the outcome and the index at the end of the file. A second call does nothing.

        The outcome says in words how the drive ended. A file that cannot be written is a `SessionError`.
        """
        if self._closed:
            return
        self._closed, whole = True, False
        try:
            if not self._failed and self._steps:
                self.flush()
                self._viewer_data.finish()
                self._outputs.send_properties(OUTCOME, {"outcome": outcome})
                self._flush_rows()
                self._outputs.send_blueprint(session_blueprint(self.info, self._viewer_data.content()))
                self._flush_rows()
                whole = True
        finally:
            self._outputs.close(self._end_index(outcome) if whole else None)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close(f"stopped by {kind.__name__}: {error}".removesuffix(": ") if kind else "ended")

    def _describe_drive(self) -> None:
        self._outputs.send_properties(INFO, encode_drive_info(self.info, self._created))
        self._outputs.send_properties(VERSIONS, self._versions)

    def _end_index(self, outcome: str) -> dict[str, Any]:
        return build_session_index(
            encode_drive_info(self.info, self._created),
            self._versions,
            steps=self._steps,
            events=self._events,
            endings=self._endings,
            outcomes=self._episode_outcomes,
            outcome=outcome,
            summary=asdict(self._summary.summary()),
        )

    def _require_space(self) -> None:
        self.notice = self._recording.follow_renamed_file() or self.notice
        if self._reserve.lacks_space(self.path.parent, self.bytes, self._steps, self._outputs.chunks):
            self.close(f"the disk is full: {self._steps} steps were recorded")
            closed = f"{self.path} was closed in time and is complete"
            raise RecordingEnded(f"the disk is full; {closed}: {self._steps} steps")

    def _write_rows(self) -> None:
        records, self._rows = self._rows, []
        if not records:
            return
        self._write_events(records)
        count_records(self._summary, records)
        steps = [record.step for record in records]
        self._outputs.send_columns(DRIVE, steps, step_record_columns(records, self.info.activations))
        self._viewer_data.add(records)
        self._viewer_data.write_changes()
        if self._viewer_data.pending >= self._viewer_rows:
            self._viewer_data.write()
        if steps[0] < _DESCRIBED_AGAIN <= steps[-1] + 1:
            self._describe_drive()  # a second copy, in case the first is damaged
        if not self._recording.on_disk:
            self._flush_rows()  # so that the first steps are in what the new file is created with
            self._recording.create_file()

    def _write_events(self, records: Sequence[StepRecord]) -> None:
        events = [event for record in records for event in record.events]
        if events:
            first = len(self._events)
            self._outputs.send_columns(EVENTS, [event.step for event in events], event_columns(events, first))
            self._events += events
        ended = [record for record in records if record.ended]
        if ended:
            self._outputs.send_columns(ENDINGS, [record.step for record in ended], episode_end_columns(ended))
            self._endings |= {record.step: record.ended for record in ended}
        outcomes = {record.step: record.outcome for record in records if record.outcome is not None}
        if outcomes:
            self._outputs.send_columns(OUTCOMES, list(outcomes), outcome_columns(outcomes, self._endings))
            self._episode_outcomes |= outcomes

    def _flush_rows(self, *, wait: bool = True) -> None:
        try:
            self._recording.flush(wait=wait)
        except SessionError:
            self._failed = True
            raise
