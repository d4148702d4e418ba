"""Record a session during a drive."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import rerun as rr

from pdtui.core.errors import RecordingEnded, SessionError
from pdtui.core.step_record import StepRecord
from pdtui.sessions.drive_info import DriveInfo, encode_drive_info
from pdtui.sessions.environment_versions import collect_versions
from pdtui.sessions.rrd.message_framing import undamaged_length
from pdtui.sessions.session_schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, VERSIONS
from pdtui.sessions.viewer.live_viewer import LiveViewer
from pdtui.sessions.viewer.session_blueprint import session_blueprint
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.viewer.viewer_data_writer import ViewerDataWriter
from pdtui.sessions.writer.arrow_columns import ComponentColumn, time_columns
from pdtui.sessions.writer.disk_space import DiskReserve
from pdtui.sessions.writer.rerun_recording import (
    abandon_recording,
    flush_recording,
    name_file_in_errors,
    open_recording,
    send_property_group,
)
from pdtui.sessions.writer.step_record_columns import episode_end_columns, event_columns, step_record_columns

_VIEW_ROWS, _LIVE_ROWS = 128, 8
_SAFE_ROWS = 16
"""Batches of up to this many control steps are waited for, which takes 0.5 ms or more per batch."""

_BATCHES_ON_THEIR_WAY = 8
"""Number of larger batches that are not waited for; a slow disk must not fill the memory."""


class SessionRecorder:
    """Writes control steps to a Rerun recording, in batches.

    Steps with events and steps that end an episode are written at once, with all steps before them. With
    small batches, `write` returns when the batch was handed to the operating system: SIGKILL loses at most
    the last `rows_per_write` − 1 steps, and the file can be read without its end. With large batches, which
    are meant for drives faster than real time, `write` does not wait for the thread that writes.

    The space on the disk is checked before each batch. Once only the end of the recording still fits, the
    recording is closed properly and `RecordingEnded` is raised. If a write fails nevertheless, as on a disk
    that others fill, the file is truncated after its last complete message, so that it can be read up to
    there.

    Args:
        path: the file; its folder is created, and an existing file is overwritten.
        info: the drive.
        rows_per_write: control steps per batch. Small batches lose less in a crash; large ones cost less.
        view_rows: control steps per batch of data that only the viewer draws.
        viewer: address of a viewer that shows the drive live; None for none.

    Raises:
        SessionError: the file cannot be written, or the disk is full.
    """

    def __init__(
        self,
        path: Path,
        info: DriveInfo,
        *,
        rows_per_write: int = 128,
        view_rows: int = _VIEW_ROWS,
        viewer: ViewerAddress | None = None,
    ) -> None:
        self.path, self.info = Path(path), info
        self._errors_named = partial(name_file_in_errors, self.path)
        self._rows_per_write = max(1, rows_per_write)
        self._rows: list[StepRecord] = []
        self._viewer_rows = max(view_rows if viewer is None else _LIVE_ROWS, 2 * self._rows_per_write)
        self._waits_for_batches = self._rows_per_write <= _SAFE_ROWS
        self._events = self._steps = self._batches = self._chunks = 0
        self._closed = self._failed = False
        batches = 1 if self._waits_for_batches else _BATCHES_ON_THEIR_WAY
        rows = self._viewer_rows + batches * self._rows_per_write
        self._reserve = DiskReserve(self.path, sum(info.layers), rows)
        self._reserve.require_space_to_begin()
        self._recording = open_recording(self.path, info)
        recording_id = self._recording.get_recording_id() or ""
        self._live = None if viewer is None else LiveViewer(viewer, info, recording_id)
        self._write_start()
        self._viewer_data = ViewerDataWriter(info, self._send, self._log_static)
        self._flush_rows()

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
        if record.events or record.ended:
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

    @property
    def bytes(self) -> int:
        """The size of the file so far, bytes."""
        return self.path.stat().st_size

    def close(self, outcome: str) -> None:
        """Write the rest, the outcome and the index at the end of the file. A second call does nothing.

        The outcome says in words how the drive ended. A file that cannot be written is a `SessionError`.
        """
        if self._closed:
            return
        self._closed = True
        try:
            if not self._failed:
                self.flush()
                self._viewer_data.finish()
                self._property(OUTCOME, {"outcome": outcome})
                self._flush_rows()
                self._send_blueprint()
        finally:
            if self._failed:
                abandon_recording(self._recording)
                with self._errors_named():
                    os.truncate(self.path, undamaged_length(self.path))
            else:
                self._recording.disconnect()
            if self._live is not None:
                self._live.close()

    def _send_blueprint(self) -> None:
        """Replace the blueprint by one for what was recorded."""
        blueprint = session_blueprint(self.info, self._viewer_data.content())
        # Active: otherwise a viewer that shows another session would reuse the layout of that one.
        self._write(lambda recording: recording.send_blueprint(blueprint, make_active=True))
        self._flush_rows()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close(f"stopped by {kind.__name__}: {error}".removesuffix(": ") if kind else "ended")

    def _write_start(self) -> None:
        info = self.info
        with self._errors_named():
            self._recording.send_recording_name(f"{info.robot}, policy {info.policy}, seed {info.seed}")
        self._property(INFO, encode_drive_info(info, datetime.now(UTC).isoformat(timespec="seconds")))
        self._property(VERSIONS, collect_versions())

    def _require_space(self) -> None:
        if self._reserve.is_short(self._steps, self._chunks):
            self.close(f"the disk is full: {self._steps} steps were recorded")
            closed = f"{self.path} was closed in time and is complete"
            raise RecordingEnded(f"the disk is full; {closed}: {self._steps} steps")

    def _write_rows(self) -> None:
        records, self._rows = self._rows, []
        if not records:
            return
        self._write_events(records)
        steps = [record.step for record in records]
        self._send(DRIVE, steps, step_record_columns(records, self.info.activations))
        self._viewer_data.add(records)
        self._viewer_data.write_changes()
        if self._viewer_data.pending >= self._viewer_rows:
            self._viewer_data.write()

    def _write_events(self, records: Sequence[StepRecord]) -> None:
        events = [event for record in records for event in record.events]
        if events:
            self._send(EVENTS, [event.step for event in events], event_columns(events, self._events))
            self._events += len(events)
        ended = [record for record in records if record.ended]
        if ended:
            self._send(ENDINGS, [record.step for record in ended], episode_end_columns(ended))

    def _send(self, entity: str, steps: Sequence[int], columns: list[ComponentColumn]) -> None:
        self._chunks += 1
        times, ready = time_columns(steps, self.info.dt), cast("list[rr.ComponentColumn]", columns)
        self._write(
            lambda recording: rr.send_columns(
                entity, times, ready, recording=recording, strict=recording is self._recording
            )
        )

    def _log_static(self, entity: str, archetype: Any) -> None:
        self._write(
            lambda recording: rr.log(
                entity, archetype, static=True, recording=recording, strict=recording is self._recording
            )
        )

    def _property(self, name: str, values: dict[str, Any]) -> None:
        self._write(lambda recording: send_property_group(recording, name, values))

    def _write(self, write: Callable[[rr.RecordingStream], object]) -> None:
        """Write to the recording, and to that of a viewer, whose errors are not the session's."""
        with self._errors_named():
            write(self._recording)
        if self._live is not None:
            self._live.send(write)

    def _flush_rows(self, *, wait: bool = True) -> None:
        """Hand everything to the operating system, so that it outlives this process."""
        try:
            with self._errors_named():
                if wait:
                    flush_recording(self._recording, self.path)
                else:
                    self._recording.flush(timeout_sec=0.0)
        except SessionError:
            self._failed = True
            raise
