"""Open, flush and abandon Rerun recordings that go into a file, with errors that name the file."""

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
from pdtui.sessions.writer.disk_space import is_disk_full

_FLUSH_SECONDS, _PATIENCE_SECONDS = 1.0, 30.0
"""How long to wait for a flush before checking whether the disk is full, and how long at most; s."""

_ARROW_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.utf8()}


def open_recording(path: Path, info: DriveInfo, recording_id: str | None = None) -> rr.RecordingStream:
    """Open a recording that is written to a file, with a blueprint; an existing file is overwritten."""
    with name_file_in_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        recording = rr.RecordingStream(APP, recording_id=recording_id)
        if not is_enabled(recording):
            why = "recording is disabled by the environment variable RERUN=off"
            raise SessionError(f"{path}: cannot be written: {why}")
        recording.set_sinks(rr.FileSink(path), default_blueprint=session_blueprint(info))
    return recording


def send_property_group(recording: rr.RecordingStream, name: str, values: Mapping[str, Any]) -> None:
    """Send a group of properties: plain values or non-empty lists of them."""
    arrays = {}
    for key, value in values.items():
        items = value if isinstance(value, list) else [value]
        arrays[key] = pa.array(items, _ARROW_TYPES[type(items[0])])
    recording.send_property(name, rr.AnyValues(**arrays))


def flush_recording(recording: rr.RecordingStream, path: Path) -> None:
    """Wait until everything was handed to the operating system; a `RuntimeError` says that it cannot be."""
    # If the writing thread ends during a flush, the flush never returns.
    deadline = time.monotonic() + _PATIENCE_SECONDS
    while True:
        try:
            recording.flush(timeout_sec=_FLUSH_SECONDS)
        except RuntimeError:
            if is_disk_full(path) or time.monotonic() > deadline:
                raise
        else:
            return


def abandon_recording(recording: rr.RecordingStream) -> None:
    """Close a recording that cannot be written, without waiting for the library if its thread has died."""
    closing = threading.Thread(target=recording.disconnect, daemon=True)
    closing.start()
    closing.join(_FLUSH_SECONDS)
    if closing.is_alive():
        atexit.unregister(rr.rerun_shutdown)  # it would wait for the same thread, for ever


@contextmanager
def name_file_in_errors(path: Path) -> Iterator[None]:
    """Turn errors of the operating system and the library into a `SessionError` that names the file."""
    try:
        yield
    except OSError as error:
        raise SessionError(f"{path}: cannot be written: {error.strerror}") from error
    except RuntimeError as error:
        # The library reports only that its thread has ended.
        why = f"the disk is full ({error})" if is_disk_full(path) else str(error)
        raise SessionError(f"{path}: cannot be written: {why}") from error
