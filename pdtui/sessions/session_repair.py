"""Repair a session whose end is missing or damaged: rescue what can be read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import rerun.chunk

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import DriveInfo, decode_drive_info
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_header import (
    SessionHeader,
    count_control_steps,
    decode_header,
    read_drive_outcome,
)
from pdtui.sessions.session_schema import DIGEST_EPISODE, DRIVE, INFO, OUTCOME, STEP
from pdtui.sessions.writer.rerun_recording import name_file_in_errors, open_recording, send_property_group

_CHUNKS_PER_FLUSH = 64


@dataclass(frozen=True)
class SessionIntegrity:
    """How much of a session can be read.

    Attributes:
        info: what was known before the first control step.
        steps: number of control steps before the first gap or the first damaged chunk.
        outcome: how the drive ended; empty if the file does not say.
        recording_id: identifier by which the viewer knows the recording.
        whole: whether every chunk, every control step, the outcome and the index at the end are there.
    """

    info: DriveInfo
    steps: int
    outcome: str
    recording_id: str
    whole: bool


def examine_session(path: Path) -> SessionIntegrity:
    """Report what can be read of a session.

    A file that is no session, or was cut off before its first control step, is a `SessionError`.
    """
    file = RrdContents(path, only=(DIGEST_EPISODE,), torn=True)
    try:
        info, _ = decode_drive_info(file.properties(INFO))
        steps = file.table(DRIVE).steps
    except SessionError as error:
        raise SessionError(f"{path}: nothing can be rescued: {error}") from error
    gaps = np.flatnonzero(steps != np.arange(len(steps)))
    kept = int(gaps[0]) if gaps.size else len(steps)
    outcome = read_drive_outcome(file)
    whole = file.finished and not gaps.size and bool(outcome)
    return SessionIntegrity(info, kept, outcome, file.recording_id, whole)


def repair_session(path: Path, output: Path) -> SessionHeader:
    """Write what can be read of a session as a complete session, with only a few chunks in memory at a time.

    Everything from the first missing step on is left out. The outcome becomes ``repaired: cut at step N``
    unless the file still says how the drive ended. The output appears only once it is complete.

    Args:
        path: the session.
        output: the repaired session; may be `path`, which is then replaced.

    Raises:
        SessionError: nothing can be rescued, or the output cannot be written.
    """
    condition = examine_session(path)
    if not output.parent.is_dir():
        raise SessionError(f"{output}: cannot be written: the folder does not exist")
    with name_file_in_errors(output), replace_file(output, SessionError) as partial:
        _rewrite(path, partial, condition)
        contents = RrdContents(partial, only=(DIGEST_EPISODE,))
        repaired = decode_header(contents, output, count_control_steps(contents.table(DRIVE)))
        if repaired.steps != condition.steps:
            found = f"found {repaired.steps} in the repaired session"
            raise SessionError(f"{path}: expected {condition.steps} steps, {found}")
        partial.chmod(path.stat().st_mode & 0o777)
    return repaired


def _rewrite(path: Path, output: Path, condition: SessionIntegrity) -> None:
    recording = open_recording(output, condition.info, condition.recording_id)
    try:
        for number, chunk in enumerate(_read_kept_chunks(path, condition.steps)):
            recording.send_chunks(chunk)
            if number % _CHUNKS_PER_FLUSH == 0:
                recording.flush()
        if not condition.outcome:
            send_property_group(recording, OUTCOME, {"outcome": f"repaired: cut at step {condition.steps}"})
        recording.flush()
    finally:
        recording.disconnect()


def _read_kept_chunks(path: Path, steps: int) -> Iterator[rerun.chunk.Chunk]:
    """Yield the chunks without rows of later steps, whose events may have been written before their data."""
    stream = iter(ChunkStream(path))
    while True:
        try:
            chunk = next(stream)
        except (SessionError, StopIteration):  # what follows damage is left out
            return
        batch = chunk.batch
        if STEP in chunk.timelines:
            batch = batch.filter(pc.less(batch.column(STEP), steps))
        if batch.num_rows:
            try:
                ready = rerun.chunk.Chunk.from_record_batch(batch)
            except (ValueError, RuntimeError, pa.ArrowException) as error:
                rows = f"rows of '{chunk.entity[:80]}'"
                raise SessionError(f"{path}: {rows} cannot be rescued: {error}") from error
            yield from ready
