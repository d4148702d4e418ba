"""The header of a session: it is read without the numbers of the steps."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pyarrow as pa
import pytest

from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import decode_drive_info, encode_drive_info
from pdtui.sessions.rrd.message_decoder import decompress_start
from pdtui.sessions.rrd.message_framing import CHUNK, read_message_spans
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded

SAMPLES = Path(__file__).parents[2] / "sessions" / "samples"


@pytest.mark.parametrize("sample", ["a1", "ant", "bipedal_walker", "walker"])
def test_the_header_says_what_the_whole_session_says(sample: str) -> None:
    path = SAMPLES / f"{sample}.rrd"
    header, session = read_session_header(path), read_session(path)
    assert vars(header) == {name: getattr(session, name) for name in vars(header)}
    assert header.steps == len(session.digests) > 0


def test_the_offset_of_an_attribute_is_recorded_and_0_in_older_sessions(
    recorded: Recorded, tmp_path: Path
) -> None:
    _, loop, records = recorded
    observed = (replace(loop.info.attributes[0], scale=0.25, offset=0.5), *loop.info.attributes[1:])
    info = replace(loop.info, attributes=observed)
    path = tmp_path / "a.rrd"
    with SessionRecorder(path, info) as recorder:
        recorder.write(records[0])
    assert read_session_header(path).info.attributes == observed
    properties = {name: [value] for name, value in encode_drive_info(info, "").items()}
    properties["layers"] = list(info.layers)
    older = [asdict(one) for one in observed]
    for one in older:
        del one["offset"]
    properties["attributes"] = [json.dumps(older)]
    assert decode_drive_info(properties)[0].attributes == (replace(observed[0], offset=0.0), *observed[1:])


def test_the_data_of_the_steps_is_not_read_for_the_header(tmp_path: Path) -> None:
    """All of a long message but its beginning is overwritten: only a reader of the steps notices."""
    sample = SAMPLES / "ant.rrd"
    data = bytearray(sample.read_bytes())
    blanked = 0
    with sample.open("rb") as file:
        for frame in read_message_spans(file, len(data)):
            if frame.kind == CHUNK and frame.length > 20_000:
                data[frame.start + 4096 : frame.end] = bytes(frame.length - 4096)
                blanked += frame.length - 4096
    path = tmp_path / "ant.rrd"
    path.write_bytes(data)
    assert blanked > 0.6 * len(data)
    assert vars(read_session_header(path)) == {**vars(read_session_header(sample)), "path": path}
    with pytest.raises(SessionError, match="a message is damaged"):
        read_session(path)


def test_a_damaged_head_of_a_chunk_is_named(tmp_path: Path) -> None:
    """In a session without an index, whose header is put together from the whole file."""
    sample = SAMPLES / "ant.rrd"
    data = bytearray(sample.read_bytes())
    with sample.open("rb") as file:
        frames = [frame for frame in read_message_spans(file, len(data)) if frame.kind == CHUNK]
    path = tmp_path / "a.rrd"
    for frame in frames[:: len(frames) // 12]:
        path.write_bytes(data[: frame.start] + b"\xff" * 64 + data[frame.start + 64 :])
        with pytest.raises(SessionError, match=rf"a\.rrd: byte {frame.start}: a message is damaged"):
            read_session_header(path)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("[1]", "expected a table of at most 100 options"),
        ('{"torque": [1]}', "expected texts, numbers, or true or false"),
        ('{"torque": Infinity}', "expected a finite number"),
        ('{"road": "\\u001b[31m"}', "expected printable text"),
        ("{", "property 'robot_options': invalid"),
    ],
)
def test_robot_options_that_are_none_are_refused(options: str, said: str) -> None:
    info = read_session_header(SAMPLES / "ant.rrd").info
    assert info.robot_options == {}  # the sample is older than the property
    properties = {
        name: value if isinstance(value, list) else [value]
        for name, value in encode_drive_info(info, "2026-01-01").items()
    }
    assert decode_drive_info(properties)[0] == info
    with pytest.raises(SessionError, match=said):
        decode_drive_info({**properties, "robot_options": [options]})


@pytest.mark.parametrize("cut", [40, 500, 3000, 10**6])
def test_the_start_of_a_block_is_decompressed_from_its_start(cut: int) -> None:
    content = b"".join(b"%d, %d, " % (number % 77, number * number) for number in range(3000)) + bytes(70_000)
    packed = pa.compress(content, codec="lz4_raw", asbytes=True)
    start = decompress_start(memoryview(packed)[:cut]).to_pybytes()
    assert content.startswith(start)
    assert len(start) >= min(cut - 300, 8192)
