"""Recording in a process of its own: a drive does not wait for it, and does not take it along when killed."""

from __future__ import annotations

import multiprocessing
import time
from dataclasses import replace
from multiprocessing.process import BaseProcess
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

from pdtui.core.closable import Closable
from pdtui.core.errors import SessionError
from pdtui.core.processes.process_start import start_process
from pdtui.core.processes.shared_ring import SharedRing
from pdtui.core.processes.worker_pool import describe_exit
from pdtui.core.step_record import StepRecord
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.environment_versions import collect_versions
from pdtui.sessions.writer.recorder_loop import RecordingState, serve_recordings
from pdtui.sessions.writer.step_record_codec import StepRecordEncoder

_RING_BYTES, _RING_STEPS = 1 << 22, 64
"""Size of a ring, bytes, and the number of control steps that it holds at least."""
_LOOK_EVERY = 0.1
"""Time between looks at whether the process is alive, s."""
_FULL_WAIT = 0.001
"""Time between attempts to write into a full ring, s."""


class RecorderProcess(Closable):
    """A process that records drives, one after the other.

    Control steps go through shared memory. A drive that is killed therefore loses none of the steps that it
    has written, and its file is completed. The process ends when this one does, in whatever way.

    Args:
        soon: whether to start the process at once, so that it loads while the drive does; otherwise, the
            first recording starts it.
    """

    def __init__(self, *, soon: bool = True) -> None:
        self._connection, self._theirs = multiprocessing.Pipe()
        self._process: BaseProcess | None = None
        # Python waits for processes when it exits, and this one waits for the end of the pipe.
        self._finalize = Finalize(self, self._connection.close, exitpriority=10)
        if soon:
            self._start()

    def _start(self) -> None:
        if self._process is None:
            module = serve_recordings.__module__
            self._process = start_process("pdtui recorder", module, serve_recordings, self._theirs)
            self._theirs.close()

    @property
    def pid(self) -> int:
        """Process id of the recorder."""
        return (self._process and self._process.pid) or 0

    def begin_recording(self, path: Path, info: DriveInfo, **options: Any) -> RemoteRecorder:
        """Begin a recording; the arguments and errors are those of `SessionRecorder`."""
        self._start()
        return RemoteRecorder(self, path, info, options)

    def send(self, message: object) -> None:
        """Send a message; `SessionError` if the process is dead."""
        try:
            self._connection.send(message)
        except OSError as error:
            raise self.make_exit_error() from error

    def receive(self) -> Any:
        """Wait for a message; `SessionError` if the process is dead."""
        try:
            return self._connection.recv()
        except (EOFError, OSError) as error:
            raise self.make_exit_error() from error

    def require_alive(self) -> None:
        """Raise a `SessionError` if the process is dead."""
        if self._process is None or not self._process.is_alive():
            raise self.make_exit_error()

    def make_exit_error(self) -> SessionError:
        """Return an error that says how the process ended."""
        how = "never started" if self._process is None else describe_exit(self._process)
        return SessionError(f"the recorder's process {how}")

    def close(self) -> None:
        """End the process once its recording is complete."""
        self._finalize()
        if self._process is not None:
            self._process.join()


class RemoteRecorder:
    """Records a drive in a `RecorderProcess`, as `SessionRecorder` does in this one.

    A failure to write is raised a few control steps later than there: steps are on their way to the process.

    Args:
        process: the process.
        path: the file.
        info: the drive.
        options: further arguments of `SessionRecorder`.
    """

    def __init__(
        self, process: RecorderProcess, path: Path, info: DriveInfo, options: dict[str, Any]
    ) -> None:
        self._process, self._encoder = process, StepRecordEncoder()
        step = 8 * (sum(info.layers) + 8 * len(info.links) + len(info.attributes)) + 4096
        self._ring = SharedRing.create(max(_RING_BYTES, 2 * _RING_STEPS * step // 8 * 8))
        self.notice = ""
        self._seen = self._bytes = 0
        self._looked = time.monotonic()
        self._closed = False
        try:
            # Those of the drive: what the recorder's process has loaded differs.
            described = {"path": path, "info": info, "versions": collect_versions(), **options}
            process.send((self._ring.path, described))
            first = process.receive()
        except SessionError:
            self._ring.close()
            raise
        finally:
            self._ring.unlink()
        if isinstance(first, SessionError):
            self._ring.close()
            raise first
        self._state: RecordingState = first
        self._seen = 1

    @property
    def path(self) -> Path:
        """Where the file is, or will be once the first control step is written."""
        return self._state.path

    @property
    def on_disk(self) -> bool:
        """Whether there is a file: not before the first control step."""
        return self._state.on_disk

    @property
    def created(self) -> str:
        """Date and time at which the drive began, ISO 8601."""
        return self._state.created

    @property
    def bytes(self) -> int:
        """The size of the file so far, bytes."""
        return self._bytes if self._closed else self._ring.reader_value

    def write(self, record: StepRecord) -> None:
        """Hand over one control step.

        Raises:
            RecordingEnded: the disk is full; the recording was closed with an earlier step as its last.
            SessionError: the file cannot be written, the process is dead, or the recorder is closed.
        """
        if self._closed:
            raise SessionError(f"{self.path}: the session is closed")
        message = self._encoder.encode(record)
        while not self._ring.write(message):
            if len(message) > self._ring.largest_message:
                raise SessionError(
                    f"{self.path}: a control step of {len(message)} bytes is too large to record"
                )
            self._require_alive()
            time.sleep(_FULL_WAIT)
        now = time.monotonic()
        if now - self._looked > _LOOK_EVERY:
            self._looked = now
            self._require_alive()
        # A state is sent before it is counted.
        while self._seen < self._ring.notice_count:
            self._take_state()
        if self._state.failure is not None:
            raise self._state.failure

    def close(self, outcome: str) -> None:
        """Wait until the recording is complete; a second call does nothing.

        The outcome says in words how the drive ended. A file that cannot be written is a `SessionError`.
        """
        if self._closed:
            return
        failure = self._state.failure
        try:
            self._process.send(outcome)
            while not self._state.closed:
                self._take_state()
        except SessionError as error:
            raise self._name_file(error) from error
        finally:
            self._bytes, self._closed = self._ring.reader_value, True
            self._ring.close()
        # A failure was raised once, where the step was written.
        if self._state.failure is not None and failure is None:
            raise self._state.failure

    def _take_state(self) -> None:
        state = self._process.receive()
        self.notice = state.notice or self.notice
        self._state = replace(state, failure=state.failure or self._state.failure)
        self._seen += 1

    def _require_alive(self) -> None:
        try:
            self._process.require_alive()
        except SessionError as error:
            raise self._name_file(error) from error

    def _name_file(self, error: SessionError) -> SessionError:
        place = f"; the recording up to then is in {self.path}" if self.on_disk else ""
        return SessionError(f"{error}{place}")
