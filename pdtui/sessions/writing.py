"""What everything that writes a recording shares: properties, and errors that name the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import rerun as rr
from rerun.recording_stream import is_enabled

from pdtui.errors import SessionError
from pdtui.sessions.blueprint import layout
from pdtui.sessions.record import DriveInfo
from pdtui.sessions.schema import APP

_ARROW_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.utf8()}


def open_recording(path: Path, info: DriveInfo, recording_id: str | None = None) -> rr.RecordingStream:
    """A recording that goes into a file, laid out for the viewer; an existing file is overwritten.

    Raises:
        SessionError: the file cannot be written.
    """
    with errors_named(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        recording = rr.RecordingStream(APP, recording_id=recording_id)
        if not is_enabled(recording):
            raise SessionError(f"{path}: cannot be written: the environment says RERUN=off")
        recording.set_sinks(rr.FileSink(path), default_blueprint=layout(info))
    return recording


def send_property(recording: rr.RecordingStream, name: str, values: Mapping[str, Any]) -> None:
    """Send a group of properties: plain values, or lists of them that are not empty."""
    arrays = {}
    for key, value in values.items():
        items = value if isinstance(value, list) else [value]
        arrays[key] = pa.array(items, _ARROW_TYPES[type(items[0])])
    recording.send_property(name, rr.AnyValues(**arrays))


@contextmanager
def errors_named(path: Path) -> Iterator[None]:
    """Turn what the operating system or the library says into a `SessionError` that names the file."""
    try:
        yield
    except OSError as error:
        raise SessionError(f"{path}: cannot be written: {error.strerror}") from error
    except RuntimeError as error:
        raise SessionError(f"{path}: cannot be written: {error}") from error
