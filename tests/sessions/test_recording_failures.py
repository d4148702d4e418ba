"""Crashes, files that cannot be written and files that are no sessions."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr

from pdtui.core.errors import SessionError
from pdtui.core.outcome import Outcome
from pdtui.sessions.drive_info import decode_drive_info, encode_drive_info
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded
from tests.sessions.recorded_drives import make_loop


def test_a_killed_recording_can_be_read_up_to_its_last_steps(weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "killed.rrd"
    command = [sys.executable, "-m", "tests.sessions.recorded_drives", str(path), str(weights)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2]
    ) as process:
        assert process.stdout is not None
        said = [process.stdout.readline() for _ in range(100)]
        process.send_signal(signal.SIGKILL)
        said += process.stdout.readlines()
    steps = [line.split() for line in said if line.endswith("\n")]
    session = read_session(path)
    assert session.steps >= len(steps) - 3
    assert session.digests[: len(steps)].tolist() == [int(digest) for _, digest in steps][: session.steps]
    assert session.outcome == ""
    assert [event.kind for event in session.events][-1] == "reset"


def test_steps_with_events_are_written_at_once(weights: Path, tmp_path: Path, recorded: Recorded) -> None:
    _, loop, records = recorded
    recorder = SessionRecorder(tmp_path / "a.rrd", loop.info, rows_per_write=1000)
    for record in records[:13]:
        recorder.write(record)
    shutil.copy(recorder.path, tmp_path / "as_it_is_now.rrd")
    recorder.close("done")
    session = read_session(tmp_path / "as_it_is_now.rrd")
    assert session.steps == 13
    assert len(session.events) == 4


def test_closing_twice_and_writing_after_it(recorded: Recorded, tmp_path: Path) -> None:
    _, loop, records = recorded
    with SessionRecorder(tmp_path / "a.rrd", loop.info) as recorder:
        recorder.write(records[0])
        recorder.close("enough")
    assert recorder.bytes > 1000
    with pytest.raises(SessionError, match="closed"):
        recorder.write(records[1])
    assert read_session(tmp_path / "a.rrd").outcome == "enough"


def test_an_exception_is_the_outcome(recorded: Recorded, tmp_path: Path) -> None:
    _, loop, records = recorded
    recorder = SessionRecorder(tmp_path / "a.rrd", loop.info)
    with pytest.raises(KeyError), recorder:
        recorder.write(records[0])
        raise KeyError("lost")
    assert read_session(tmp_path / "a.rrd").outcome == "stopped by KeyError: 'lost'"


def test_a_drive_without_steps_leaves_no_file(recorded: Recorded, tmp_path: Path) -> None:
    recorder = SessionRecorder(tmp_path / "a.rrd", recorded[1].info)
    assert not recorder.on_disk
    recorder.close("nothing happened")
    assert not list(tmp_path.iterdir())


def test_a_diverged_step_is_kept_with_its_reason(recorded: Recorded, tmp_path: Path) -> None:
    _, loop, records = recorded
    lost = records[1]._replace(
        attributes=np.full_like(records[1].attributes, np.nan),
        poses=np.full_like(records[1].poses, np.nan),
        ended="the simulation diverged at 0.05 s",
        outcome=Outcome.DIVERGED,
    )
    with SessionRecorder(tmp_path / "a.rrd", loop.info) as recorder:
        recorder.write(records[0])
        recorder.write(lost)
    session = read_session(tmp_path / "a.rrd")
    assert session.endings == {1: "the simulation diverged at 0.05 s"}
    assert session.outcomes == {1: Outcome.DIVERGED}
    assert np.isnan(session.attributes[1]).all()


def test_a_path_under_a_file_cannot_be_written(recorded: Recorded, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "a.rrd"
    with pytest.raises(SessionError, match=r"file/a\.rrd: cannot be written"):
        SessionRecorder(path, recorded[1].info)


def test_a_folder_is_no_file(recorded: Recorded, tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="already exists"):
        SessionRecorder(tmp_path, recorded[1].info)


def test_a_disabled_library_is_reported(weights: Path, tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path\n"
        "from tests.sessions.recorded_drives import record_drive\n"
        "record_drive(Path(sys.argv[1]), Path(sys.argv[2]), 3)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "a.rrd"), str(weights)],
        env={**os.environ, "RERUN": "off"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert "SessionError" in done.stderr
    assert "RERUN=off" in done.stderr


def test_missing_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match=r"none\.rrd: no such file"):
        read_session(tmp_path / "none.rrd")
    (tmp_path / "text.rrd").write_text("hello, this is no recording")
    with pytest.raises(SessionError, match=r"text\.rrd: expected a Rerun recording"):
        read_session(tmp_path / "text.rrd")
    (tmp_path / "empty.rrd").touch()
    with pytest.raises(SessionError, match=r"empty\.rrd: expected a Rerun recording"):
        read_session(tmp_path / "empty.rrd")
    with pytest.raises(SessionError, match="cannot be read"):
        read_session(tmp_path)


def foreign(path: Path, app: str, **columns: pa.Array) -> Path:
    """A recording of some program with one row under /drive."""
    with rr.RecordingStream(app) as recording:
        recording.save(path)
        recording.set_time("step", sequence=0)
        recording.log("/drive", rr.AnyValues(**columns))
    return path


def test_another_programs_recording(tmp_path: Path) -> None:
    path = foreign(tmp_path / "other.rrd", "other_app", x=pa.array([1.0]))
    with pytest.raises(SessionError, match=r"other\.rrd: expected a recording of pdtui, .*'other_app'"):
        read_session(path)


def test_missing_properties(tmp_path: Path) -> None:
    path = foreign(tmp_path / "bare.rrd", "pdtui", x=pa.array([1.0]))
    with pytest.raises(SessionError, match=r"bare\.rrd: property 'schema'"):
        read_session(path)


def test_missing_streams(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "thin.rrd"
    with rr.RecordingStream("pdtui") as recording:
        recording.save(path)
        properties = encode_drive_info(recorded[1].info, "2026-01-01T00:00:00+00:00")
        arrays = {name: pa.array(v if isinstance(v, list) else [v]) for name, v in properties.items()}
        recording.send_property("drive", rr.AnyValues(**arrays))
        recording.set_time("step", sequence=0)
        recording.log("/drive", rr.AnyValues(something=pa.array([1.0])))
    with pytest.raises(SessionError, match=r"thin\.rrd: stream '/drive/reward_cost_action' is missing"):
        read_session(path)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_a_torn_file_is_called_torn(share: float, recorded: Recorded, tmp_path: Path) -> None:
    whole = recorded[0].read_bytes()
    path = tmp_path / "torn.rrd"
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(SessionError, match=r"torn\.rrd: the file is torn"):
        read_session(path)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", "-1"),
        ("seed", "1e5"),
        ("dt", float("nan")),
        ("dt", 0.0),
        ("layers", [0]),
        ("layers", []),
        ("attributes", "["),
        ("attributes", "{}"),
        ("attributes", '[{"name": "vx"}]'),
        ("links", '[{"name": "x", "body": -1, "shape": "sphere", "size": [1]}]'),
        ("links", "[" * 100_000),
        ("schema", 99),
        ("stochastic", "yes"),
    ],
)
def test_a_doctored_property_is_named(name: str, value: object, recorded: Recorded) -> None:
    properties = encode_drive_info(recorded[1].info, "2026-01-01T00:00:00+00:00")
    listed = {key: item if isinstance(item, list) else [item] for key, item in properties.items()}
    assert decode_drive_info(listed)[0] == recorded[1].info
    listed[name] = value if isinstance(value, list) else [value]
    with pytest.raises(SessionError, match=f"property '{name}'"):
        decode_drive_info(listed)


def test_the_loop_of_the_tests_repeats_itself(weights: Path) -> None:
    one, other = make_loop(weights), make_loop(weights)
    assert [one.advance().digest for _ in range(5)] == [other.advance().digest for _ in range(5)]
