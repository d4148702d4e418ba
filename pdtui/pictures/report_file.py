"""Recordings of pictures that open laid out in the Rerun viewer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.recording_stream import is_enabled

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import PictureError


@contextmanager
def open_report_file(path: Path, app: str, layout: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """Yield a recording that is in its file when the block ends without an error.

    Args:
        path: The file; its folder is made, and an existing file is replaced once the recording is whole.
        app: Name of the application, by which viewers remember a user's own layout.
        layout: How the recording opens.

    Raises:
        PictureError: The file cannot be written.
    """
    try:
        recording = rr.RecordingStream(app)
        if not is_enabled(recording):
            raise PictureError(f"{path}: cannot be written: the environment says RERUN=off")
        with replace_file(path, PictureError) as partial:
            recording.set_sinks(rr.FileSink(partial), default_blueprint=layout)
            try:
                yield recording
            finally:
                recording.disconnect()
    except RuntimeError as error:
        raise PictureError(f"{path}: cannot be written: {error}") from error
