"""Write a session while it is driven."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import rerun as rr
from rich import filesize

from pdtui.core.errors import RecordingEnded, SessionError
from pdtui.core.step_record import StepRecord
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.drive_info_codec import encode_drive_info
from pdtui.sessions.environment_versions import collect_versions
from pdtui.sessions.rrd.message_framing import undamaged_length
from pdtui.sessions.session_schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, VERSIONS
from pdtui.sessions.viewer.live_viewer import LiveViewer
from pdtui.sessions.viewer.session_blueprint import session_blueprint
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.viewer.viewer_data_writer import ViewerDataWriter
from pdtui.sessions.writer.arrow_columns import ComponentColumn, time_columns
from pdtui.sessions.writer.disk_space import DiskReserve, free_space
from pdtui.sessions.writer.rerun_recording import (
    abandon,
    flush,
    name_file_in_errors,
    open_recording,
    send_property,
)
from pdtui.sessions.writer.step_record_columns import ending_columns, event_columns, step_record_columns

_VIEW_ROWS, _LIVE_ROWS = 128, 8
_SAFE_ROWS = 16
"""Batches up to this length are waited for; a wait costs 0.5 ms, on a busy machine more."""

_BATCHES_ON_THEIR_WAY = 8
"""So many of the larger ones are not waited for: what the disk does not take must not fill the memory."""


class SessionRecorder:
    """Writes control steps to a Rerun recording, in batches.

    Steps with events, and those that end an episode, are written at once with all before them. With small
    batches, `write` returns when the operating system has what is due: SIGKILL loses at most the last
    `rows_per_write` − 1 steps, and the file can be read without its end. With large batches, which are for
    drives faster than time, it does not wait for the thread that writes.

    Before each batch it looks at the room that is left on the disk. While the recording's end still fits, it
    ends it, whole, and raises `RecordingEnded`. Where a write fails all the same, as on a disk that others
    fill, the file is cut behind its last whole message, so that it can be read up to there.

    Args:
        path: the file; its folder is made, an existing file is overwritten.
        info: what determines the run.
        rows_per_write: control steps a batch. Small batches lose less in a crash; large ones cost less.
        view_rows: control steps a batch of what only the viewer draws.
        viewer: where a viewer listens that shows the drive, too; None for none.

    Raises:
        SessionError: the file cannot be written, or there is no room for a recording.
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
        self._rows_per_write = max(1, rows_per_write)
        self._rows: list[StepRecord] = []
        self._view_rows = max(view_rows if viewer is None else _LIVE_ROWS, 2 * self._rows_per_write)
        self._waits = self._rows_per_write <= _SAFE_ROWS
        self._events = self._steps = self._batches = self._chunks = 0
        self._closed = self._failed = False
        rows = self._view_rows + self._rows_per_write * (1 if self._waits else _BATCHES_ON_THEIR_WAY)
        self._reserve = DiskReserve(self.path, sum(info.layers), rows)
        self._require_room_to_begin()
        self._recording = open_recording(self.path, info)
        self._live: LiveViewer | None = None
        if viewer is not None:
            self._live = LiveViewer(viewer, info, self._recording.get_recording_id() or "")
        self._write_start()
        self._views = ViewerDataWriter(info, self._send, self._log_static)
        self._send_off()

    def write(self, record: StepRecord) -> None:
        """Take in one control step; the recorder keeps its arrays, so nobody may change them.

        Raises:
            RecordingEnded: the disk is full; the recording was closed with this step as its last.
            SessionError: the file cannot be written, or the recorder is closed.
        """
        if self._closed:
            raise SessionError(f"{self.path}: the session is closed")
        self._rows.append(record)
        self._steps += 1
        if record.events or record.ended:
            self._require_room()
            self.flush()
        elif len(self._rows) >= self._rows_per_write:
            self._require_room()
            self._write_rows()
            self._batches += 1
            self._send_off(wait=self._waits or self._batches % _BATCHES_ON_THEIR_WAY == 0)

    def flush(self) -> None:
        """Write all steps so far and wait until the operating system has them.

        Raises:
            SessionError: the file cannot be written.
        """
        self._write_rows()
        self._send_off()

    @property
    def bytes(self) -> int:
        """Size of the file so far."""
        return self.path.stat().st_size

    def close(self, outcome: str) -> None:
        """Write the rest, the outcome and the file's footer. A second call does nothing.

        Args:
            outcome: how the drive ended, in words; not empty.

        Raises:
            SessionError: the file cannot be written.
        """
        if self._closed:
            return
        self._closed = True
        try:
            if not self._failed:
                self.flush()
                self._views.finish()
                self._property(OUTCOME, {"outcome": outcome})
                self._send_off()
                self._lay_out()
        finally:
            if self._failed:
                abandon(self._recording)
                self._cut()
            else:
                self._recording.disconnect()
            if self._live is not None:
                self._live.close()

    def _lay_out(self) -> None:
        """Lay out what there is, now that it is known."""
        content = self._views.content()
        with self._errors_named():
            # Active, or a viewer that shows another session would lay this one out like that.
            self._recording.send_blueprint(session_blueprint(self.info, content), make_active=True)
        self._send_off()
        if self._live is not None:
            self._live.lay_out(content)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close(f"stopped by {kind.__name__}: {error}".removesuffix(": ") if kind else "ended")

    def _write_start(self) -> None:
        info = self.info
        name = f"{info.robot}, policy {info.policy}, seed {info.seed}"
        with self._errors_named():
            self._recording.send_recording_name(name)
        created = datetime.now(UTC).isoformat(timespec="seconds")
        self._property(INFO, encode_drive_info(info, created))
        self._property(VERSIONS, collect_versions())

    def _require_room_to_begin(self) -> None:
        with self._errors_named():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            left, needed = free_space(self.path.parent), self._reserve.to_begin
        if left < needed:
            raise SessionError(
                f"{self.path}: cannot be written: the disk is full: {filesize.decimal(left)} are left, "
                f"a recording begins with {filesize.decimal(needed)}"
            )

    def _require_room(self) -> None:
        if not self._reserve.is_short(self._steps, self._chunks):
            return
        self.close(f"the disk is full: {self._steps} steps were recorded")
        raise RecordingEnded(
            f"the disk is full; {self.path} was closed in time and is whole: {self._steps} steps"
        )

    @contextmanager
    def _failure_noted(self) -> Iterator[None]:
        try:
            with self._errors_named():
                yield
        except SessionError:
            self._failed = True
            raise

    def _cut(self) -> None:
        """Leave out the message that the disk did not take whole: a file that ends in one cannot be read."""
        with self._errors_named():
            os.truncate(self.path, undamaged_length(self.path))

    def _write_rows(self) -> None:
        records, self._rows = self._rows, []
        if not records:
            return
        self._write_events(records)
        steps = [record.step for record in records]
        self._send(DRIVE, steps, step_record_columns(records, self.info.activations))
        self._views.add(records)
        self._views.write_changes()
        if self._views.pending >= self._view_rows:
            self._views.write()

    def _write_events(self, records: Sequence[StepRecord]) -> None:
        events = [event for record in records for event in record.events]
        if events:
            self._send(EVENTS, [event.step for event in events], event_columns(events, self._events))
            self._events += len(events)
        ended = [record for record in records if record.ended]
        if ended:
            self._send(ENDINGS, [record.step for record in ended], ending_columns(ended))

    def _send(self, entity: str, steps: Sequence[int], columns: list[ComponentColumn]) -> None:
        self._chunks += 1
        with self._errors_named():
            ready = cast("list[rr.ComponentColumn]", columns)
            rr.send_columns(
                entity, time_columns(steps, self.info.dt), ready, recording=self._recording, strict=True
            )
        if self._live is not None:
            self._live.send(entity, steps, columns)

    def _log_static(self, entity: str, archetype: Any) -> None:
        with self._errors_named():
            rr.log(entity, archetype, static=True, recording=self._recording, strict=True)
        if self._live is not None:
            self._live.log_static(entity, archetype)

    def _property(self, name: str, values: dict[str, Any]) -> None:
        with self._errors_named():
            send_property(self._recording, name, values)
        if self._live is not None:
            self._live.send_property(name, values)

    def _send_off(self, *, wait: bool = True) -> None:
        """Hand everything to the operating system, where it outlives this process."""
        with self._failure_noted():
            if wait:
                flush(self._recording, self.path)
            else:
                self._recording.flush(timeout_sec=0.0)

    def _errors_named(self) -> AbstractContextManager[None]:
        return name_file_in_errors(self.path)
