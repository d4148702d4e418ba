"""Cut files: what can be read of them becomes a whole session."""

from __future__ import annotations

import io
import random
import struct
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.message_framing import RrdMessageSpan, read_message_spans
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_activations, read_session
from pdtui.sessions.session_repair import repair_session
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded
from tests.sessions.recorded_drives import make_loop, record_drive
from tests.sessions.test_recording_failures import foreign

SAMPLES = Path(__file__).parents[2] / "sessions" / "samples"


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
    assert repaired.header.info == recorded[1].info
    assert RrdReader(torn).recordings() == RrdReader(recorded[0]).recordings()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.rrd", "torn.rrd"]


def test_a_whole_session_is_whole(recorded: Recorded) -> None:
    assert examine_session(recorded[0]).whole
    assert examine_session(recorded[0]).outcome == "the operator quit"


def spans(data: bytes | bytearray) -> list[RrdMessageSpan]:
    with io.BytesIO(data) as file:
        return list(read_message_spans(file, len(data)))


@pytest.mark.parametrize("claimed", [2**62, 2**33, 5000, 0])
def test_a_wrong_length_loses_only_its_message(claimed: int, recorded: Recorded, tmp_path: Path) -> None:
    """A message in the middle claims to be of another length: what is before and behind it is kept."""
    data = bytearray(recorded[0].read_bytes())
    found = spans(data)
    damaged = found[len(found) // 2]
    struct.pack_into("<Q", data, damaged.begin + 8, claimed)
    path = tmp_path / "a.rrd"
    path.write_bytes(data)
    there = examine_session(path)
    assert not there.whole
    assert [(span.start, span.end) for span in there.damage] == [(damaged.begin, damaged.end)]
    assert repair_session(path, tmp_path / "repaired.rrd").outcome == "the operator quit"
    assert examine_session(tmp_path / "repaired.rrd").whole


@pytest.mark.parametrize("sealed", [True, False])
def test_flipped_bits_cost_at_most_the_message_they_are_in(
    sealed: bool, recorded: Recorded, tmp_path: Path
) -> None:
    """Messages of all kinds in turn, in a session with checksums, and in an old one without."""
    source = recorded[0] if sealed else SAMPLES / "bipedal_walker.rrd"
    data = source.read_bytes()
    before = read_session(source)
    drawn = random.Random(5)
    found = spans(data)[:-1]
    path, output = tmp_path / "a.rrd", tmp_path / "b.rrd"
    for span in found[::7] if sealed else found[::61]:
        place = drawn.randrange(span.begin, span.end)
        changed = bytearray(data)
        changed[place] ^= 1 << drawn.randrange(8)
        path.write_bytes(changed)
        there = examine_session(path)
        if there.whole:  # without checksums, some bits matter to nobody
            assert not sealed
            continue
        assert all(span.begin <= damage.start <= damage.end <= span.end for damage in there.damage)
        output.unlink(missing_ok=True)
        repaired = repair_session(path, output)
        assert repaired.outcome == before.outcome
        session = read_session(output)
        kept = np.delete(np.arange(before.steps), list(chain(*(range(*gap) for gap in session.gaps))))
        kept = kept[: len(session.digests)]
        assert (session.digests == before.digests[kept]).all()
        assert session.attributes.tobytes() == before.attributes[kept].tobytes()
        assert sealed <= (session.events == before.events)
        rows = before.steps - len(kept)
        assert rows <= (64 if sealed else 128)
        assert examine_session(output).whole


def test_two_damaged_places_are_two_gaps(weights: Path, tmp_path: Path) -> None:
    path, output = tmp_path / "a.rrd", tmp_path / "b.rrd"
    record_drive(path, weights, rows_per_write=4)
    data = bytearray(path.read_bytes())
    rows = [span for span in spans(data) if b"digest_episode" in data[span.start : span.end]]
    for span in (rows[3], rows[9]):
        data[span.start + span.length // 2] ^= 1
    path.write_bytes(data)
    repaired = repair_session(path, output)
    assert len(repaired.header.gaps) == 2
    session = read_session(output)
    assert session.gaps == repaired.header.gaps
    assert session.missing == sum(end - first for first, end in session.gaps)
    assert session.steps == 100
    assert all("missing" in line for line in repaired.describe_losses())


def test_missing_last_steps_are_a_gap(weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    record_drive(path, weights, rows_per_write=4)
    data = bytearray(path.read_bytes())
    last = [span for span in spans(data)[:-1] if b"digest_episode" in data[span.start : span.end]][-1]
    data[last.start + last.length // 2] ^= 1
    path.write_bytes(data)
    repaired = repair_session(path, tmp_path / "b.rrd")
    (gap,) = repaired.header.gaps
    assert gap[0] in range(96, 100)
    assert gap[1] == 100
    session = read_session(tmp_path / "b.rrd")
    assert (session.steps, session.gaps, len(session.digests)) == (100, (gap,), gap[0])
    cut = tmp_path / "c.rrd"
    cut.write_bytes((tmp_path / "b.rrd").read_bytes()[:-100])
    assert repair_session(cut, cut).header.gaps == (gap,)


@pytest.mark.parametrize("rows", [4, 16])
@pytest.mark.parametrize("which", [0, 2, -1])
def test_a_session_with_a_gap_is_read_block_by_block(
    which: int, rows: int, weights: Path, tmp_path: Path
) -> None:
    path = tmp_path / "a.rrd"
    record_drive(path, weights, rows_per_write=rows)
    data = bytearray(path.read_bytes())
    span = [span for span in spans(data)[:-1] if b"digest_episode" in data[span.start : span.end]][which]
    data[span.start + span.length // 2] ^= 1
    path.write_bytes(data)
    header = repair_session(path, tmp_path / "b.rrd").header
    blocks = list(read_step_blocks(read_session_header(tmp_path / "b.rrd"), poses=True, block_steps=10))
    assert sum(len(block) for block in blocks) == header.steps - header.missing < 100


def test_a_second_repair_keeps_the_gaps_of_the_first(weights: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    record_drive(path, weights, rows_per_write=4)
    gaps = []
    for number in (5, 9):
        data = bytearray(path.read_bytes())
        rows = [span for span in spans(data) if b"digest_episode" in data[span.start : span.end]]
        data[rows[number].start + 40] ^= 1
        path.write_bytes(data)
        gaps.append(repair_session(path, path).header.gaps)
    assert len(gaps[0]) == 1
    assert len(gaps[1]) == 2
    assert set(gaps[0]) < set(gaps[1])


def test_a_damaged_description_is_read_from_its_copies(recorded: Recorded, tmp_path: Path) -> None:
    data = bytearray(recorded[0].read_bytes())
    described = [span for span in spans(data) if b"policy_hash" in data[span.start : span.end]][:-1]
    assert len(described) == 2
    path = tmp_path / "a.rrd"
    for span in described:
        data[span.start + span.length // 2] ^= 16
        path.write_bytes(data)
        output = tmp_path / f"{span.start}.rrd"
        assert repair_session(path, output).header.info == recorded[1].info
        assert read_session(output).info == recorded[1].info


def test_messages_that_are_missing_or_exchanged_are_seen(recorded: Recorded, tmp_path: Path) -> None:
    data = recorded[0].read_bytes()
    a, b = spans(data)[8:10]
    first, second = data[a.begin : a.end], data[b.begin : b.end]
    path = tmp_path / "a.rrd"
    for between in (second, first, second + first, first + first + second):
        path.write_bytes(data[: a.begin] + between + data[b.end :])
        there = examine_session(path)
        assert not there.whole
        assert there.damage


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


@pytest.mark.parametrize("place", range(12))
def test_a_flipped_bit_in_the_start_of_the_file_is_seen_and_mended(
    place: int, recorded: Recorded, tmp_path: Path
) -> None:
    data = bytearray(recorded[0].read_bytes())
    data[place] ^= 2
    path = tmp_path / "a.rrd"
    path.write_bytes(data)
    assert not examine_session(path).whole
    assert repair_session(path, tmp_path / "b.rrd").header.missing == 0
    assert examine_session(tmp_path / "b.rrd").whole
    assert read_session(tmp_path / "b.rrd").steps == 100
