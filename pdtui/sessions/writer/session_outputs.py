"""Where a drive is recorded: in the session's file and, if asked, in a viewer that shows it live."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import rerun as rr
import rerun.blueprint as rrb

from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.viewer.live_viewer import LiveViewer
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.writer.arrow_columns import ComponentColumn, time_columns
from pdtui.sessions.writer.rerun_recording import RerunRecording, send_property_group
from pdtui.sessions.writer.session_file import SessionFile


class SessionOutputs:
    """Sends everything to the recording in the file, and to that of a viewer.

    An error of the file is a `SessionError`; those of a viewer are not the session's.

    Args:
        file: the file.
        info: the drive.
        created: date and time at which it began, ISO 8601.
        viewer: address of a viewer; None for none.

    Attributes:
        recording: the recording in the file.
        chunks: number of chunks of rows that were sent.
    """

    def __init__(
        self, file: SessionFile, info: DriveInfo, created: str, viewer: ViewerAddress | None
    ) -> None:
        self._dt = info.dt
        self.chunks = 0
        self.recording = RerunRecording(file, info, created)
        shown_as = self.recording.application, self.recording.recording_id
        self._live = None if viewer is None else LiveViewer(viewer, info, *shown_as)
        with self.recording.errors_named():
            name = f"{info.robot}, policy {info.policy}, seed {info.seed}"
            self.recording.stream.send_recording_name(name)

    def send_columns(self, entity: str, steps: Sequence[int], columns: list[ComponentColumn]) -> None:
        """Send rows of an entity, one for each of these control steps."""
        self.chunks += 1
        times, ready = time_columns(steps, self._dt), cast("list[rr.ComponentColumn]", columns)
        own = self.recording.stream
        self._send(lambda to: rr.send_columns(entity, times, ready, recording=to, strict=to is own))

    def log_static(self, entity: str, archetype: Any) -> None:
        """Log what applies to the whole recording."""
        own = self.recording.stream
        self._send(lambda to: rr.log(entity, archetype, static=True, recording=to, strict=to is own))

    def send_properties(self, name: str, values: Mapping[str, Any]) -> None:
        """Send a group of properties: plain values or non-empty lists of them."""
        self._send(lambda to: send_property_group(to, name, values))

    def send_blueprint(self, blueprint: rrb.Blueprint) -> None:
        """Replace the layout in which a viewer shows the recording."""
        # Active: otherwise a viewer that shows another session would reuse the layout of that one.
        self._send(lambda to: to.send_blueprint(blueprint, make_active=True))

    def close(self, end_index: dict[str, Any] | None) -> None:
        """Complete the file, with an index if it is whole, and leave the viewer."""
        try:
            self.recording.close(end_index)
        finally:
            if self._live is not None:
                self._live.close()

    def _send(self, send: Callable[[rr.RecordingStream], object]) -> None:
        with self.recording.errors_named():
            send(self.recording.stream)
        if self._live is not None:
            self._live.send(send)
