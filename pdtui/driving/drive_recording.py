"""The recording of a drive at its pace, if it is recorded."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from pdtui.core.errors import SessionError
from pdtui.core.step_record import StepRecord
from pdtui.driving.drive_config import DriveConfig
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.writer.recorder_process import RecorderProcess, RemoteRecorder

PACED_ROWS_PER_WRITE = 4  # control steps; a drive at its pace is written often, so that a kill loses little


class DriveRecording:
    """Records a drive as its configuration says, or not at all.

    Args:
        config: the drive.
        info: what is known about it before its first control step.
        process: the process that records.

    Attributes:
        notice: what the user should read now; may be empty.
        failure: why the recording had to end before the drive; empty while it goes on.

    Raises:
        SessionError: the file exists or cannot be written.
    """

    def __init__(self, config: DriveConfig, info: DriveInfo, process: RecorderProcess) -> None:
        self.notice = self.failure = ""
        self._recorder: RemoteRecorder | None = None
        self._place = ""
        if not config.recording:
            return
        viewer = config.viewer
        if viewer is not None and not viewer.is_listening:
            self.notice, viewer = viewer.absence_message, None
        self._recorder = process.begin_recording(
            Path(config.recording),
            replace(info, activations=config.activations),
            rows_per_write=PACED_ROWS_PER_WRITE,
            viewer=viewer,
            existing=config.existing,
            sync=config.sync,
        )

    @property
    def path(self) -> str:
        """Where the file is, or will be; empty without a recording."""
        return "" if self._recorder is None else str(self._recorder.path)

    @property
    def on_disk(self) -> bool:
        """Whether there is a file: not before the first control step."""
        return self._recorder is not None and self._recorder.on_disk

    @property
    def created(self) -> str:
        """Date and time at which the drive began, ISO 8601; empty without one."""
        return "" if self._recorder is None else self._recorder.created

    @property
    def bytes(self) -> int:
        """The size of the file so far, bytes."""
        return 0 if self._recorder is None else self._recorder.bytes

    def write(self, record: StepRecord) -> bool:
        """Record a control step, and return whether the file is at a new place."""
        recorder = self._recorder
        if recorder is None:
            return False
        try:
            recorder.write(record)
        except SessionError as error:
            # A step that is not recorded cannot be repeated, so the drive ends here and the screen says why.
            self.failure = str(error)
            with suppress(SessionError):
                recorder.close(self.failure)
        if recorder.notice:
            self.notice, recorder.notice = recorder.notice, ""
        if recorder.on_disk and self.path != self._place:
            self._place = self.path
            return True
        return False

    def close(self, outcome: str) -> None:
        """Complete the recording, with how the drive ended in words; a second call does nothing."""
        if self._recorder is not None:
            self._recorder.close(outcome)
