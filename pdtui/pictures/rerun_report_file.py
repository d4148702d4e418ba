"""Recordings of pictures that open laid out in the Rerun viewer, and the Markdown of their tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.recording_stream import is_enabled
from rich.table import Table

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import PictureError

TIME = "time"
"""Timeline of every report."""


@contextmanager
def open_report_file(path: Path, app: str, layout: rrb.Tabs | rrb.Vertical) -> Iterator[rr.RecordingStream]:
    """Yield a recording that is in its file when the block ends without an error.

    The file's folder is made, and an existing file is replaced once the recording is whole. Viewers remember
    a user's own layout by the name of the app.

    Raises:
        PictureError: The file cannot be written.
    """
    try:
        recording = rr.RecordingStream(app)
        if not is_enabled(recording):
            raise PictureError(f"{path}: cannot be written: the environment says RERUN=off")
        with replace_file(path, PictureError) as partial:
            panel = rrb.TimePanel(timeline=TIME, state="hidden")
            blueprint = rrb.Blueprint(layout, panel, collapse_panels=True)
            recording.set_sinks(rr.FileSink(partial), default_blueprint=blueprint)
            try:
                yield recording
            finally:
                recording.disconnect()
    except RuntimeError as error:
        raise PictureError(f"{path}: cannot be written: {error}") from error


def table_to_markdown(table: Table) -> str:
    """Return a table that the terminal prints, with its title, as Markdown."""
    headers = [str(column.header) for column in table.columns]
    columns = [[str(cell) for cell in column.cells] for column in table.columns]
    return f"## {table.title}\n\n" + rows_to_markdown(headers, list(zip(*columns, strict=True)))


def rows_to_markdown(headers: list[str], rows: Sequence[tuple[str, ...]]) -> str:
    """Return a table of text as Markdown."""
    if not rows:
        return "None."
    lines = [headers, ["---"] * len(headers), *rows]
    return "\n".join("| " + " | ".join(_escape(cell) for cell in line) + " |" for line in lines)


def _escape(cell: str) -> str:
    return cell.replace("|", "\\|").replace("*", "\\*").replace("\n", " ")
