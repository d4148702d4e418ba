"""What everything that writes a recording shares: properties, and errors that name the file."""

from __future__ import annotations

import atexit
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import rerun as rr
from rerun.recording_stream import is_enabled

from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import APP
from pdtui.sessions.viewer.session_blueprint import session_blueprint
from pdtui.sessions.writer.disk_space import is_full

_ANSWER, _PATIENCE = 1.0, 30.0
"""How long a flush is waited for before the disk is looked at, and at most; s."""

_ARROW_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.utf8()}


def open_recording(path: Path, info: DriveInfo, recording_id: str | None = None) -> rr.RecordingStream:
    """A recording that goes into a file, laid out for the viewer; an existing file is overwritten.

    Raises:
        SessionError: the file cannot be written.
    """
    with name_file_in_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        recording = rr.RecordingStream(APP, recording_id=recording_id)
        if not is_enabled(recording):
            raise SessionError(f"{path}: cannot be written: the environment says RERUN=off")
        recording.set_sinks(rr.FileSink(path), default_blueprint=session_blueprint(info))
    return recording


def send_property(recording: rr.RecordingStream, name: str, values: Mapping[str, Any]) -> None:
    """Send a group of properties: plain values, or lists of them that are not empty."""
    arrays = {}
    for key, value in values.items():
        items = value if isinstance(value, list) else [value]
        arrays[key] = pa.array(items, _ARROW_TYPES[type(items[0])])
    recording.send_property(name, rr.AnyValues(**arrays))


def flush(recording: rr.RecordingStream, path: Path) -> None:
    """Wait until the operating system has everything.

    Raises:
        RuntimeError: the file cannot be written.
    """
    # A flush that meets the end of the thread that writes is never answered.
    deadline = time.monotonic() + _PATIENCE
    while True:
        try:
            recording.flush(timeout_sec=_ANSWER)
        except RuntimeError:
            if is_full(path) or time.monotonic() > deadline:
                raise
        else:
            return


def abandon(recording: rr.RecordingStream) -> None:
    """Close a file that cannot be written; where the library waits for its own dead thread, do not wait."""
    closing = threading.Thread(target=recording.disconnect, daemon=True)
    closing.start()
    closing.join(_ANSWER)
    if closing.is_alive():
        atexit.unregister(rr.rerun_shutdown)  # it would wait for the same thread, and the program never end


@contextmanager
def name_file_in_errors(path: Path) -> Iterator[None]:
    """Turn what the operating system or the library says into a `SessionError` that names the file."""
    try:
        yield
    except OSError as error:
        raise SessionError(f"{path}: cannot be written: {error.strerror}") from error
    except RuntimeError as error:
        # The library says only that its thread is gone.
        why = f"the disk is full ({error})" if is_full(path) else str(error)
        raise SessionError(f"{path}: cannot be written: {why}") from error
