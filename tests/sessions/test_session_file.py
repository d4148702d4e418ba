"""Files of sessions: nothing is overwritten, and a file that is deleted or renamed meanwhile is not lost."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from pdtui.core.errors import SessionError
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.session_repair import repair_session
from pdtui.sessions.writer.session_file import SYNC_MODES, SyncMode, is_being_recorded
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded


def record(recorded: Recorded, recorder: SessionRecorder, first: int = 0, end: int | None = None) -> None:
    for one in recorded[2][first:end]:
        recorder.write(one)


def digests(recorded: Recorded) -> list[int]:
    return [one.digest for one in recorded[2]]


def test_an_existing_file_is_refused_and_stays_as_it_is(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    path.write_text("mine")
    with pytest.raises(SessionError, match=r"a\.rrd: already exists"):
        SessionRecorder(path, recorded[1].info)
    assert path.read_text() == "mine"


def test_a_file_that_appears_after_the_start_is_not_overwritten(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    recorder = SessionRecorder(path, recorded[1].info, rows_per_write=4)
    path.write_text("mine")
    with pytest.raises(SessionError, match=r"a\.rrd: cannot be written: File exists"):
        record(recorded, recorder)
    recorder.close("stopped")
    assert path.read_text() == "mine"


def test_two_recorders_of_one_name_write_two_files(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    both = [SessionRecorder(path, recorded[1].info, existing="number") for _ in range(2)]
    for one in recorded[2]:
        for recorder in both:
            recorder.write(one)
    for recorder in both:
        recorder.close("done")
    assert {recorder.path.name for recorder in both} == {"a.rrd", "a-2.rrd"}
    for recorder in both:
        assert read_session(recorder.path).digests.tolist() == digests(recorded)


def test_a_file_is_replaced_only_by_a_whole_one(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    path.write_text("the old one")
    recorder = SessionRecorder(path, recorded[1].info, existing="replace", rows_per_write=4)
    record(recorded, recorder)
    assert path.read_text() == "the old one"
    assert recorder.path == tmp_path / "a.new.rrd"
    recorder.close("done")
    assert recorder.path == path
    assert read_session(path).digests.tolist() == digests(recorded)
    assert [one.name for one in tmp_path.iterdir()] == ["a.rrd"]


def test_of_two_that_replace_one_file_the_second_is_refused(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    path.write_text("the old one")
    first = SessionRecorder(path, recorded[1].info, existing="replace", rows_per_write=4)
    for _ in range(2):
        with pytest.raises(SessionError, match=r"a\.rrd: cannot be replaced: it is being recorded"):
            SessionRecorder(path, recorded[1].info, existing="replace")
        record(recorded, first, 0, 50)
    first.close("done")
    SessionRecorder(path, recorded[1].info, existing="replace").close("no steps")
    second = SessionRecorder(path, recorded[1].info, existing="replace")
    second.close("no steps")
    assert examine_session(path).steps == 100


def test_a_file_that_appears_after_the_start_is_not_replaced(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    recorder = SessionRecorder(path, recorded[1].info, existing="replace", rows_per_write=4)
    path.write_text("mine")
    with pytest.raises(SessionError, match=r"a\.rrd: cannot be written: File exists"):
        record(recorded, recorder)
    recorder.close("stopped")
    assert path.read_text() == "mine"


def test_a_file_that_is_being_recorded_is_locked(recorded: Recorded, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    recorder = SessionRecorder(path, recorded[1].info, rows_per_write=4)
    record(recorded, recorder)
    recorder.flush()
    assert is_being_recorded(path)
    with pytest.raises(SessionError, match="cannot be replaced: it is being recorded"):
        SessionRecorder(path, recorded[1].info, existing="replace")
    with pytest.raises(SessionError, match="it is being recorded"):
        repair_session(path, path)
    recorder.close("done")
    assert not is_being_recorded(path)


def test_a_renamed_file_is_followed(recorded: Recorded, tmp_path: Path) -> None:
    path, other = tmp_path / "a.rrd", tmp_path / "kept" / "b.rrd"
    recorder = SessionRecorder(path, recorded[1].info, rows_per_write=4)
    record(recorded, recorder, 0, 50)
    other.parent.mkdir()
    path.rename(other)
    record(recorded, recorder, 50)
    assert recorder.notice == f"{path} was renamed: the recording goes on in {other}"
    recorder.close("done")
    assert not path.exists()
    assert read_session(other).digests.tolist() == digests(recorded)
    assert examine_session(other).whole


@pytest.mark.parametrize("how", ["deleted", "replaced", "folder"])
def test_a_deleted_file_is_written_again(how: str, recorded: Recorded, tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    path = folder / "a.rrd"
    recorder = SessionRecorder(path, recorded[1].info, rows_per_write=4)
    record(recorded, recorder, 0, 50)
    if how == "folder":
        shutil.rmtree(folder)
    elif how == "replaced":
        (folder / "other").write_text("somebody's")
        (folder / "other").rename(path)
    else:
        path.unlink()
    record(recorded, recorder, 50)
    recorder.close("done")
    place = folder / ("a-2.rrd" if how == "replaced" else "a.rrd")
    assert recorder.path == place
    assert recorder.notice.startswith(f"{path} was deleted: the recording goes on in {place}")
    assert read_session(place).digests.tolist() == digests(recorded)
    assert examine_session(place).whole
    assert how != "replaced" or path.read_text() == "somebody's"


@pytest.mark.parametrize("sync", SYNC_MODES)
def test_every_way_to_force_data_to_the_disk_writes_the_same(
    sync: SyncMode, recorded: Recorded, tmp_path: Path
) -> None:
    path = tmp_path / "a.rrd"
    with SessionRecorder(path, recorded[1].info, rows_per_write=4, sync=sync) as recorder:
        record(recorded, recorder)
    assert examine_session(path).whole
    assert read_session(path).digests.tolist() == digests(recorded)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_named_at_the_start(recorded: Recorded, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(SessionError, match=r"a\.rrd: cannot be written: Permission denied"):
        SessionRecorder(tmp_path / "a.rrd", recorded[1].info)


def test_a_program_that_ends_without_closing_leaves_its_steps(recorded: Recorded, tmp_path: Path) -> None:
    import subprocess
    import sys

    code = (
        "import sys; from pathlib import Path\n"
        "from pdtui.sessions.writer.session_recorder import SessionRecorder\n"
        "from tests.sessions.recorded_drives import make_loop, random_weights\n"
        "folder = Path(sys.argv[1]); loop = make_loop(random_weights(folder / 'w.safetensors'))\n"
        "recorder = SessionRecorder(folder / 'a.rrd', loop.info, rows_per_write=4)\n"
        "for _ in range(40): recorder.write(loop.advance())\n"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=root, check=True, timeout=60)
    assert done.returncode == 0
    there = examine_session(tmp_path / "a.rrd")
    assert (there.steps, there.whole) == (40, False)
    assert repair_session(tmp_path / "a.rrd", tmp_path / "b.rrd").steps == 40
