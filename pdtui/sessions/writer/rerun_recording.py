"""A Rerun recording that is written into a session's file, with errors that name the file."""

from __future__ import annotations

import atexit
import errno
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import pyarrow as pa
import rerun as rr
from rerun.recording_stream import is_enabled

from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import rerun_application_id
from pdtui.sessions.viewer.session_blueprint import session_blueprint
from pdtui.sessions.writer.message_pipe import MessagePipe
from pdtui.sessions.writer.session_file import SessionFile

_ARROW_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.utf8()}
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class RerunRecording:
    """A Rerun recording that is written into a file, with a blueprint.

    Args:
        file: the file.
        info: the drive, for the blueprint.
        created: date and time at which the drive began, ISO 8601.
        recording_id: identifier by which the viewer knows the recording; a new one if it is empty.

    Attributes:
        stream: Rerun's recording.
        application, recording_id: what the viewer knows it by.

    Raises:
        SessionError: recording is disabled.
    """

    def __init__(self, file: SessionFile, info: DriveInfo, created: str, recording_id: str = "") -> None:
        self.recording_id = recording_id or uuid4().hex
        self.application = rerun_application_id(info.robot, created, self.recording_id)
        self.stream = rr.RecordingStream(self.application, recording_id=self.recording_id)
        if not is_enabled(self.stream):
            why = "recording is disabled by the environment variable RERUN=off"
            raise SessionError(f"{file.path}: cannot be written: {why}")
        with name_file_in_errors(file.path):
            self._pipe, self._closed = MessagePipe(file), False
            self.stream.set_sinks(
                rr.FileSink(self._pipe.writing_path), default_blueprint=session_blueprint(info)
            )
            self._pipe.start()
        # A program that ends without closing its recording leaves all that was recorded.
        atexit.register(self.close)

    @property
    def path(self) -> Path:
        """Where the file is, or will be."""
        return self._pipe.file.path

    @property
    def size(self) -> int:
        """Number of bytes written so far."""
        return self._pipe.file.size

    @property
    def on_disk(self) -> bool:
        """Whether the file was created."""
        return self._pipe.file.on_disk

    def create_file(self) -> None:
        """Create the file, if that was not done yet; what was sent before is then written into it."""
        with self.errors_named():
            self._pipe.create_file()

    def follow_renamed_file(self) -> str:
        """Find out whether the file was deleted or renamed, as `SessionFile.follow_renamed_file` does."""
        with self.errors_named():
            return self._pipe.follow_renamed_file()

    def flush(self, *, wait: bool = True) -> None:
        """Hand everything to the operating system, so that it outlives this process; or only begin to."""
        if not wait:
            self.stream.flush(timeout_sec=0.0)
            return
        with self.errors_named():
            self.stream.flush()
            self._pipe.drain()

    def close(self, end_index: dict[str, Any] | None = None) -> None:
        """Write the rest, and the index at the end of the file; a second call does nothing.

        Without an `end_index`, the file is readable but not whole.
        """
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        self._pipe.end_index = end_index
        with self.errors_named():
            self.stream.disconnect()
            self._pipe.close()

    @contextmanager
    def errors_named(self) -> Iterator[None]:
        """Turn errors of the operating system and the library into a `SessionError` that names the file."""
        with name_file_in_errors(self.path):
            yield


def send_property_group(stream: rr.RecordingStream, name: str, values: Mapping[str, Any]) -> None:
    """Send a group of properties: plain values or non-empty lists of them."""
    arrays = {}
    for key, value in values.items():
        items = value if isinstance(value, list) else [value]
        arrays[key] = pa.array(items, _ARROW_TYPES[type(items[0])])
    stream.send_property(name, rr.AnyValues(**arrays))


@contextmanager
def name_file_in_errors(path: Path) -> Iterator[None]:
    """Turn errors of the operating system and the library into a `SessionError` that names the file."""
    try:
        yield
    except OSError as error:
        why = "the disk is full" if error.errno in _FULL else error.strerror or str(error)
        raise SessionError(f"{path}: cannot be written: {why}") from error
    except (RuntimeError, ValueError) as error:
        raise SessionError(f"{path}: cannot be written: {error}") from error
