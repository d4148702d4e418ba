"""Recording in a process of its own: the same sessions, and what kills leave of them."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import RecordingEnded, SessionError
from pdtui.core.outcome import Outcome
from pdtui.core.scenery import RoadLine, Scenery, Traffic
from pdtui.core.step_record import ReplacedAction, StepRecord
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.recorder_loop import KILLED
from pdtui.sessions.writer.recorder_process import RecorderProcess, RemoteRecorder
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.sessions.writer.step_record_codec import StepRecordDecoder, StepRecordEncoder
from tests.sessions.conftest import Recorded
from tests.sessions.recorded_drives import events_of, make_loop
from tests.waiting import wait_until_whole

PATIENCE = 120.0


@pytest.fixture(scope="module")
def process() -> Iterator[RecorderProcess]:
    with RecorderProcess() as process:
        yield process


def read_chunks(path: Path) -> list[tuple[str, dict[str, object]]]:
    """All rows of a recording in the order in which they were written, without what only names it."""
    named = ("rerun.controls.RowId", "RecordingInfo:start_time")
    return [
        (
            chunk.entity,
            {
                name: chunk.batch.column(name).to_pylist()
                for name in chunk.batch.schema.names
                if name not in named
            },
        )
        for chunk in ChunkStream(path)
    ]


@pytest.mark.parametrize("rows", [4, 128])
def test_the_session_is_the_same_to_the_last_bit(
    process: RecorderProcess, recorded: Recorded, tmp_path: Path, rows: int
) -> None:
    _, loop, records = recorded
    here, there = tmp_path / "here.rrd", tmp_path / "there.rrd"
    with SessionRecorder(here, loop.info, rows_per_write=rows) as own:
        for record in records:
            own.write(record)
        own.close("the operator quit")
    remote = process.begin_recording(there, loop.info, rows_per_write=rows)
    for record in records:
        remote.write(record)
    remote.close("the operator quit")
    assert examine_session(there).whole
    assert (remote.path, remote.on_disk) == (there, True)
    assert remote.bytes == there.stat().st_size
    first, second = read_chunks(here), read_chunks(there)
    assert len(first) > 20
    created = own.created, remote.created
    assert [entity for entity, _ in first] == [entity for entity, _ in second]
    for (entity, one), (_, two) in zip(first, second, strict=True):
        assert repr(one).replace(created[0], "") == repr(two).replace(created[1], ""), entity


def test_everything_that_a_step_can_hold_survives(recorded: Recorded) -> None:
    records = [*recorded[2]]
    road = Scenery(lines=(RoadLine("road edge", np.zeros((3, 2))),))
    traffic = Traffic(np.array([3]), ("vehicle",), np.ones((1, 4)), np.ones((1, 3)), np.empty((0, 2)))
    records.append(
        records[-1]._replace(scenery=road, traffic=traffic, replaced=(ReplacedAction(1, 0.1 + 0.2),))
    )
    records.append(
        records[-1]._replace(action=np.zeros((0,), np.float64), outcome=Outcome.FELL, ended="fell")
    )
    records.append(records[0])
    encoder, decoder = StepRecordEncoder(), StepRecordDecoder()
    seen: list[StepRecord] = []
    for record in records:
        again = decoder.decode(encoder.encode(record))
        seen.append(again)
        for field, value in record._asdict().items():
            other = getattr(again, field)
            if isinstance(value, np.ndarray):
                assert (other.dtype, other.shape, other.tobytes()) == (
                    value.dtype,
                    value.shape,
                    value.tobytes(),
                )
            elif field == "scenery":
                assert len(other.lines) == len(value.lines)
            elif field == "traffic":
                assert other.poses.tolist() == value.poses.tolist()
            else:
                assert other == value, field
    assert seen[-2].scenery is seen[-3].scenery  # the same object in every step of a world
    assert seen[0].traffic is records[0].traffic  # the one that says that there is none


def record_and_die(path: Path, weights: Path) -> None:
    """Record 300 steps without a screen, and be killed."""
    loop = make_loop(weights)
    with RecorderProcess() as process:
        recorder = process.begin_recording(path, loop.info)
        for step in range(300):
            recorder.write(loop.advance(events_of(step)))
        os.kill(os.getpid(), signal.SIGKILL)


def test_a_drive_that_is_killed_loses_no_step(weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    child = subprocess.run(
        [sys.executable, "-m", __name__, str(path), str(weights)],
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )
    assert child.returncode == -signal.SIGKILL
    wait_until_whole(path)
    session = read_session(path)
    assert session.steps == 300
    assert session.outcome == KILLED


def test_a_recorder_that_is_killed_ends_the_drive_with_one_sentence(
    recorded: Recorded, tmp_path: Path
) -> None:
    _, loop, records = recorded
    path = tmp_path / "a.rrd"
    with RecorderProcess() as process:
        recorder = begin_with(process, path, loop.info, records[:40])
        os.kill(process.pid, signal.SIGKILL)
        with pytest.raises(SessionError) as caught:
            write_on(recorder, records[40:])
        line = f"the recorder's process was killed by SIGKILL; the recording up to then is in {path}"
        assert str(caught.value) == line
        with pytest.raises(SessionError, match="was killed by SIGKILL"):
            recorder.close("it was killed")
        recorder.close("again")
    assert read_session(path).steps >= 36


def test_what_cannot_be_recorded_is_said_at_once_and_the_process_goes_on(
    process: RecorderProcess, recorded: Recorded, tmp_path: Path
) -> None:
    there, loop, records = recorded
    with pytest.raises(SessionError, match="already exists"):
        process.begin_recording(there, loop.info)
    unstarted = process.begin_recording(tmp_path / "b.rrd", loop.info)
    unstarted.close("before its first step")
    assert not unstarted.on_disk
    assert not unstarted.path.exists()
    recorder = process.begin_recording(tmp_path / "a.rrd", replace(loop.info, activations="off"))
    recorder.write(records[0])
    recorder.close("done")
    with pytest.raises(SessionError, match="the session is closed"):
        recorder.write(records[1])
    assert read_session(tmp_path / "a.rrd").steps == 1


def test_a_full_disk_ends_the_drive_with_a_recording_that_is_whole(
    recorded: Recorded, tmp_path: Path
) -> None:
    _, loop, records = recorded
    path = tmp_path / "a.rrd"
    with RecorderProcess() as process:
        recorder = begin_with(process, path, loop.info, records[:20])
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (recorder.bytes + 1_000_000, -1))
        with pytest.raises(
            RecordingEnded, match=f"the disk is full; {path} was closed in time and is complete"
        ):
            write_on(recorder, records[20:])
        recorder.close("the disk is full")
    assert examine_session(path).whole
    assert 20 <= read_session(path).steps < 100


def test_a_file_that_is_renamed_is_followed(
    process: RecorderProcess, recorded: Recorded, tmp_path: Path
) -> None:
    _, loop, records = recorded
    recorder = process.begin_recording(tmp_path / "a.rrd", loop.info, rows_per_write=4)
    recorder.write(records[4]._replace(step=0))
    wait_for(recorder, 1, recorder.path)
    (tmp_path / "a.rrd").rename(tmp_path / "b.rrd")
    for record in records[5:30]:
        recorder.write(record)
    recorder.close("done")
    assert recorder.path == tmp_path / "b.rrd"
    assert "was renamed: the recording goes on in" in recorder.notice


def begin_with(
    process: RecorderProcess, path: Path, info: DriveInfo, records: list[StepRecord]
) -> RemoteRecorder:
    """Begin a recording with some steps, and wait until at most three of them are not in the file."""
    recorder = process.begin_recording(path, info, rows_per_write=4)
    for record in records:
        recorder.write(record)
    wait_for(recorder, len(records) - 3, path)
    return recorder


def wait_for(recorder: RemoteRecorder, steps: int, path: Path) -> None:
    """Wait until so many steps are in the file."""
    deadline = time.monotonic() + PATIENCE
    while not (path.exists() and examine_session(path).steps >= steps):
        assert time.monotonic() < deadline, recorder.bytes
        time.sleep(0.02)


def write_on(recorder: RemoteRecorder, records: list[StepRecord]) -> None:
    """Write steps at a pace until that fails."""
    deadline = time.monotonic() + PATIENCE
    for record in records:
        assert time.monotonic() < deadline
        recorder.write(record)
        time.sleep(0.02)


if __name__ == "__main__":
    record_and_die(Path(sys.argv[1]), Path(sys.argv[2]))
