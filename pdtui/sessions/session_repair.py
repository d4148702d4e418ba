"""Repair a session that is damaged or cut off: everything in it that is whole is rescued."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import rerun as rr
import rerun.chunk

from pdtui.core.atomic_file import replace_file
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import encode_drive_info
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.rrd.rrd_contents import PROPERTIES
from pdtui.sessions.session_header_index import build_session_index
from pdtui.sessions.session_integrity import SessionIntegrity, examine_session, examine_session_by_decoding
from pdtui.sessions.session_schema import EVENTS, INFO, OUTCOME, REPAIR, STEP, VERSIONS
from pdtui.sessions.writer.arrow_columns import time_columns
from pdtui.sessions.writer.rerun_recording import RerunRecording, name_file_in_errors, send_property_group
from pdtui.sessions.writer.session_file import SessionFile, is_being_recorded
from pdtui.sessions.writer.step_record_columns import event_columns

_CHUNKS_PER_FLUSH = 64


def repair_session(path: Path, output: Path) -> SessionIntegrity:
    """Write everything that is whole in a session as a new session, with a few chunks in memory at a time.

    Control steps that cannot be rescued are reported as gaps, behind which the rest is kept. The description
    of the drive, of which a session has several copies, and its layout are written anew. The outcome becomes
    ``repaired: cut at step N`` unless the file still says how the drive ended. The output appears only once
    it is complete.

    Args:
        path: the session.
        output: the repaired session; may be `path`, which is then replaced.

    Returns:
        What was found in `path`, and was written.

    Raises:
        SessionError: nothing can be rescued, or the output cannot be written.
    """
    found = examine_session_by_decoding(path)
    if not output.parent.is_dir():
        raise SessionError(f"{output}: cannot be written: the folder does not exist")
    if output.exists() and is_being_recorded(output):
        raise SessionError(f"{output}: cannot be written: it is being recorded")
    with name_file_in_errors(output), replace_file(output, SessionError) as partial:
        partial.unlink()
        outcome = found.outcome or f"repaired: cut at step {found.steps}"
        written = replace(found, header=replace(found.header, path=output, outcome=outcome))
        _rewrite(path, partial, written)
        again = examine_session(partial)
        if not again.whole or again.steps != found.steps:
            raise SessionError(f"{path}: cannot be repaired: {found.steps} steps were to be rescued")
        partial.chmod(path.stat().st_mode & 0o777)
    return written


def _rewrite(path: Path, output: Path, found: SessionIntegrity) -> None:
    header = found.header
    drive = encode_drive_info(header.info, header.created)
    recording = RerunRecording(SessionFile(output), header.info, header.created, found.recording_id)
    stream = recording.stream
    try:
        recording.create_file()
        for name, values in (
            (INFO, drive),
            (VERSIONS, header.versions),
            (OUTCOME, {"outcome": header.outcome}),
        ):
            if values:
                send_property_group(stream, name, values)
        if found.describe_losses():
            gaps = json.dumps(header.gaps)
            send_property_group(stream, REPAIR, {"gaps": gaps, "lost_events": found.lost_events})
        _send_events(stream, header.events, header.info.dt)
        for number, chunk in enumerate(_read_kept_chunks(path, header.steps)):
            stream.send_chunks(chunk)
            if number % _CHUNKS_PER_FLUSH == 0:
                recording.flush()
        recording.flush()
        index = build_session_index(
            drive,
            header.versions,
            steps=header.steps,
            events=header.events,
            endings=header.endings,
            outcomes=header.outcomes,
            outcome=header.outcome,
            gaps=header.gaps,
        )
    except BaseException:
        recording.close()
        raise
    recording.close(index)


def _send_events(stream: rr.RecordingStream, events: Sequence[DriveEvent], dt: float) -> None:
    if events:
        times = time_columns([event.step for event in events], dt)
        columns: Any = event_columns(events, 0)
        rr.send_columns(EVENTS, times, columns, recording=stream, strict=True)


def _read_kept_chunks(path: Path, steps: int) -> Iterator[rerun.chunk.Chunk]:
    """Yield the chunks that are not written anew, without rows of later steps than the last that is there."""
    anew = {EVENTS, *(f"{PROPERTIES}{name}" for name in (INFO, VERSIONS, OUTCOME, REPAIR))}
    for chunk in ChunkStream(path, damage=[]):
        batch = chunk.batch
        if chunk.entity in anew:
            continue
        if STEP in chunk.timelines:
            batch = batch.filter(pc.less(batch.column(STEP), steps))
        if batch.num_rows:
            try:
                ready = rerun.chunk.Chunk.from_record_batch(batch)
            except (ValueError, RuntimeError, pa.ArrowException) as error:
                rows = f"rows of '{chunk.entity[:80]}'"
                raise SessionError(f"{path}: {rows} cannot be rescued: {error}") from error
            yield from ready
