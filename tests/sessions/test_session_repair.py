"""Cut files: what can be read of them becomes a whole session."""

from __future__ import annotations

import random
import struct
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from pdtui.core.errors import SessionError
from pdtui.sessions.session_reader import read_activations, read_session
from pdtui.sessions.session_repair import examine_session, repair_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded
from tests.sessions.recorded_drives import make_loop
from tests.sessions.test_recording_failures import foreign


@pytest.fixture(scope="module")
def start(recorded: Recorded, tmp_path_factory: pytest.TempPathFactory) -> int:
    """Bytes of a session before its first step."""
    path = tmp_path_factory.mktemp("start") / "a.rrd"
    recorder = SessionRecorder(path, recorded[1].info)
    size = recorder.bytes
    recorder.close("nothing")
    return size


def cut(recorded: Recorded, path: Path, size: int) -> Path:
    path.write_bytes(recorded[0].read_bytes()[:size])
    return path


def test_every_cut_after_the_first_step_is_repaired(recorded: Recorded, start: int, tmp_path: Path) -> None:
    _, _, records = recorded
    size = recorded[0].stat().st_size
    drawn = random.Random(4)
    lengths = set()
    for number in range(12):
        torn = cut(recorded, tmp_path / f"torn{number}.rrd", drawn.randrange(start, size))
        there = examine_session(torn)
        assert not there.whole
        output = tmp_path / f"repaired{number}.rrd"
        heading = repair_session(torn, output)
        session = read_session(output)
        steps = session.steps
        lengths.add(steps)
        assert heading.steps == there.steps == steps
        assert session.digests.tolist() == [record.digest for record in records[:steps]]
        assert list(session.events) == [event for record in records[:steps] for event in record.events]
        assert session.outcome in (f"repaired: cut at step {steps}", "the operator quit")
        assert read_activations(output).tobytes() == b"".join(
            record.activations.tobytes() for record in records[:steps]
        )
        assert examine_session(output).whole
        assert RrdReader(output).store()
        assert RrdReader(output).blueprints()
    assert len(lengths) > 2
    assert max(lengths) == 100


def test_repairing_in_place_keeps_who_it_is(recorded: Recorded, tmp_path: Path) -> None:
    torn = cut(recorded, tmp_path / "torn.rrd", recorded[0].stat().st_size * 3 // 5)
    link = tmp_path / "link.rrd"
    link.symlink_to(torn)
    repaired = repair_session(link, link)
    assert link.is_symlink()
    assert read_session(torn).steps == repaired.steps > 0
    assert repaired.info == recorded[1].info
    assert RrdReader(torn).recordings() == RrdReader(recorded[0]).recordings()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.rrd", "torn.rrd"]


def test_a_whole_session_is_whole(recorded: Recorded) -> None:
    assert examine_session(recorded[0]).whole
    assert examine_session(recorded[0]).outcome == "the operator quit"


def test_a_broken_middle_is_cut_there(recorded: Recorded, tmp_path: Path) -> None:
    """A message in the middle claims to be of another length: what is before it is kept."""
    data = bytearray(recorded[0].read_bytes())
    headers, place = [], 12
    while place + 16 <= len(data):
        headers.append(place)
        place += 16 + struct.unpack_from("<QQ", data, place)[1]
    for claimed in (2**62, 2**33, 0):
        path = tmp_path / f"{claimed}.rrd"
        struct.pack_into("<Q", data, headers[len(headers) // 2] + 8, claimed)
        path.write_bytes(data)
        assert not examine_session(path).whole
        repaired = repair_session(path, tmp_path / "repaired.rrd")
        assert repaired.outcome == f"repaired: cut at step {repaired.steps}"
        assert 0 < repaired.steps <= 100


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "expected a Rerun recording"),
        (random.Random(1).randbytes(5000), "expected a Rerun recording"),
        (b"RRF2", "cannot be read|contains no recording|torn"),
        (b"RRF2" + random.Random(1).randbytes(5000), "cannot be read|contains no recording|torn"),
    ],
)
def test_what_is_no_session_cannot_be_repaired(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "x.rrd"
    path.write_bytes(content)
    with pytest.raises(SessionError, match=rf"x\.rrd: .*({message})"):
        repair_session(path, tmp_path / "out.rrd")
    assert not (tmp_path / "out.rrd").exists()


def test_another_programs_recording_is_left_alone(tmp_path: Path) -> None:
    import pyarrow as pa

    path = foreign(tmp_path / "other.rrd", "other_app", x=pa.array([1.0]))
    with pytest.raises(SessionError, match="expected a recording of pdtui"):
        repair_session(path, tmp_path / "out.rrd")
    bare = foreign(tmp_path / "bare.rrd", "pdtui", x=pa.array([1.0]))
    with pytest.raises(SessionError, match=r"bare\.rrd: nothing can be rescued: property 'schema'"):
        repair_session(bare, tmp_path / "out.rrd")


def test_an_output_that_cannot_be_written_is_named(recorded: Recorded, tmp_path: Path) -> None:
    torn = cut(recorded, tmp_path / "torn.rrd", recorded[0].stat().st_size * 3 // 5)
    with pytest.raises(SessionError, match=r"nowhere/out\.rrd: cannot be written"):
        repair_session(torn, tmp_path / "nowhere" / "out.rrd")


def test_a_recording_that_still_grows_can_be_examined(weights: Path, tmp_path: Path) -> None:
    loop = make_loop(weights)
    recorder = SessionRecorder(tmp_path / "a.rrd", loop.info, rows_per_write=4)
    for _ in range(10):
        recorder.write(loop.advance())
    recorder.flush()
    there = examine_session(tmp_path / "a.rrd")
    recorder.close("done")
    assert (there.steps, there.outcome, there.whole) == (10, "", False)
