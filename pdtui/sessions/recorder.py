"""Write a session while it is driven."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import rerun as rr

from pdtui.errors import SessionError
from pdtui.sessions.columns import Column, indexes
from pdtui.sessions.properties import info_to_properties
from pdtui.sessions.record import DriveInfo, StepRecord
from pdtui.sessions.rows import drive_columns, ending_columns, event_columns
from pdtui.sessions.schema import DRIVE, ENDINGS, EVENTS, INFO, OUTCOME, VERSIONS
from pdtui.sessions.versions import environment_versions
from pdtui.sessions.views import Views
from pdtui.sessions.writing import errors_named, open_recording, send_property

_VIEW_ROWS = 32
_SAFE_ROWS = 16
"""Batches up to this length are waited for; a wait costs 0.5 ms, on a busy machine more."""


class SessionRecorder:
    """Writes control steps to a Rerun recording, in batches.

    Steps with events, and those that end an episode, are written at once with all before them. With small
    batches, `write` returns when the operating system has what is due: SIGKILL loses at most the last
    `rows_per_write` − 1 steps, and the file can be read without its end. With large batches, which are for
    drives faster than time, it does not wait for the thread that writes.

    Args:
        path: the file; its folder is made, an existing file is overwritten.
        info: what determines the run.
        rows_per_write: control steps a batch. Small batches lose less in a crash; large ones cost less.

    Raises:
        SessionError: the file cannot be written.
    """

    def __init__(self, path: Path, info: DriveInfo, *, rows_per_write: int = 128) -> None:
        self.path, self.info = Path(path), info
        self._rows_per_write = max(1, rows_per_write)
        self._rows: list[StepRecord] = []
        self._events = 0
        self._closed = False
        self._recording = open_recording(self.path, info)
        self._write_start()
        self._views = Views(info, self._send, self._log_static)
        self._send_off()

    def write(self, record: StepRecord) -> None:
        """Take in one control step; the recorder keeps its arrays, so nobody may change them.

        Raises:
            SessionError: the file cannot be written, or the recorder is closed.
        """
        if self._closed:
            raise SessionError(f"{self.path}: the session is closed")
        self._rows.append(record)
        if record.events or record.ended:
            self.flush()
        elif len(self._rows) >= self._rows_per_write:
            self._write_rows()
            self._send_off(wait=self._rows_per_write <= _SAFE_ROWS)

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
            self.flush()
            self._views.finish()
            self._property(OUTCOME, {"outcome": outcome})
            self._send_off()
        finally:
            self._recording.disconnect()

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
        self._property(INFO, info_to_properties(info, created))
        self._property(VERSIONS, environment_versions())

    def _write_rows(self) -> None:
        records, self._rows = self._rows, []
        if not records:
            return
        self._write_events(records)
        self._send(DRIVE, [record.step for record in records], drive_columns(records))
        self._views.add(records)
        self._views.write_changes()
        if self._views.pending >= max(_VIEW_ROWS, 2 * self._rows_per_write):
            self._views.write()

    def _write_events(self, records: Sequence[StepRecord]) -> None:
        events = [event for record in records for event in record.events]
        if events:
            self._send(EVENTS, [event.step for event in events], event_columns(events, self._events))
            self._events += len(events)
        ended = [record for record in records if record.ended]
        if ended:
            self._send(ENDINGS, [record.step for record in ended], ending_columns(ended))

    def _send(self, entity: str, steps: Sequence[int], columns: list[Column]) -> None:
        with self._errors_named():
            ready = cast("list[rr.ComponentColumn]", columns)
            rr.send_columns(
                entity, indexes(steps, self.info.dt), ready, recording=self._recording, strict=True
            )

    def _log_static(self, entity: str, archetype: Any) -> None:
        with self._errors_named():
            rr.log(entity, archetype, static=True, recording=self._recording, strict=True)

    def _property(self, name: str, values: dict[str, Any]) -> None:
        with self._errors_named():
            send_property(self._recording, name, values)

    def _send_off(self, *, wait: bool = True) -> None:
        """Hand everything to the operating system, where it outlives this process."""
        with self._errors_named():
            if wait:
                self._recording.flush()
            else:
                self._recording.flush(timeout_sec=0.0)

    def _errors_named(self) -> AbstractContextManager[None]:
        return errors_named(self.path)
