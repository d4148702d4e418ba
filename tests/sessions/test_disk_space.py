"""A disk that fills up: the recording ends whole while its end fits, or can be read up to what fitted."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from pdtui.core.errors import SessionError
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.disk_space import free_space
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded

ROOT = Path(__file__).parents[2]
LIMITED = """
import resource, sys
from pathlib import Path
from pdtui.core.errors import PdtuiError
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.recorded_drives import make_loop
path, weights, rows, early, late = Path(sys.argv[1]), Path(sys.argv[2]), *map(int, sys.argv[3:])
def limit(size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
limit(early)
loop = make_loop(weights)
steps = 0
try:
    recorder = SessionRecorder(path, loop.info, rows_per_write=rows)
    # The limit that comes now is not looked for: it stands for others, who fill the disk between two looks.
    while True:
        recorder.write(loop.advance())
        steps += 1
        if late and steps == 40:
            recorder.flush()
            recorder._require_space = lambda: None
            limit(recorder.bytes + late)
except PdtuiError as error:
    print(steps, type(error).__name__, error)
    try:
        recorder.close("nobody asked")
    except (NameError, PdtuiError):
        pass
"""


def run(path: Path, weights: Path, rows: int, early: int, late: int = 0) -> list[str]:
    """Record under limits on the file's size until that fails; steps, the error's name and the error."""
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, *map(str, (path, weights, rows, early, late))],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split(maxsplit=2)


def test_a_recording_ends_whole_before_the_disk_is_full(weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    steps, name, said = run(path, weights, 4, 2_200_000)
    assert name == "RecordingEnded"
    assert said.startswith(f"the disk is full; {path} was closed in time and is complete: ")
    there = examine_session(path)
    assert there.whole
    assert there.steps == int(steps) + 1
    assert there.outcome == f"the disk is full: {there.steps} steps were recorded"


@pytest.mark.parametrize("rows", [4, 128])
def test_a_write_that_fails_leaves_what_can_be_read(rows: int, weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    steps, name, said = run(path, weights, rows, 8_000_000, 300_000)
    assert name == "SessionError"
    assert said.startswith(f"{path}: cannot be written: the disk is full")
    session = read_session(path)
    assert session.outcome == ""
    assert 40 < session.steps <= int(steps) + 1
    if rows == 4:
        assert session.steps > int(steps) - 8  # what was handed over and did not fit, and what was not yet


def test_no_recording_begins_on_a_full_disk(weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    _, name, said = run(path, weights, 4, 500_000)
    assert name == "SessionError"
    assert "a.rrd: cannot be written: the disk is full: " in said
    assert not path.exists()


def test_room_is_what_the_disk_and_the_limit_leave(tmp_path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    assert free_space(tmp_path, 1000) > 500
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1500, before[1]))
        assert free_space(tmp_path, 1000) == 500
        assert free_space(tmp_path, 2000) == 0
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_recorder_says_when_it_is_closed_by_a_full_disk(recorded: Recorded, tmp_path: Path) -> None:
    _, loop, records = recorded
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    recorder = SessionRecorder(tmp_path / "a.rrd", loop.info, rows_per_write=4)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (recorder.bytes + 1_200_000, before[1]))
        with pytest.raises(SessionError, match="the disk is full; .*a.rrd was closed in time"):
            for record in records:
                recorder.write(record)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    with pytest.raises(SessionError, match="closed"):
        recorder.write(records[-1])
    assert examine_session(tmp_path / "a.rrd").whole
