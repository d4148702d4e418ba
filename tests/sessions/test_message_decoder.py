"""What is inside the messages of a file: decoded, or refused before it takes memory."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pytest

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.arrow_checks import MAX_ROWS, read_record_batch
from pdtui.sessions.rrd.message_decoder import MAX_MESSAGE, decode_chunk
from pdtui.sessions.rrd.message_framing import CHUNK, read_message_spans
from pdtui.sessions.rrd.protobuf_wire import read_fields
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_reader import read_session
from tests.sessions.conftest import Recorded

SAMPLES = Path(__file__).parents[2] / "sessions" / "samples"


def stream(batch: pa.RecordBatch, **options: object) -> pa.Buffer:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema, options=pa.ipc.IpcWriteOptions(**options)) as writer:
        writer.write_batch(batch)
    return sink.getvalue()


def batch(**columns: pa.Array) -> pa.RecordBatch:
    return pa.record_batch(columns)


def test_rows_come_back() -> None:
    given = batch(
        step=pa.array([1, 2]), names=pa.array([["a"], []]), fixed=pa.array([b"ab", b"cd"], pa.binary(2))
    )
    assert read_record_batch(stream(given)).equals(given)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (stream(batch(x=pa.array([0.0] * 10_000)), compression="zstd"), "compressed"),
        (stream(batch(x=pa.array([0.0] * 10_000)), compression="lz4"), "compressed"),
        (stream(batch(x=pa.nulls(1000))), "type null"),
        (stream(batch(x=pa.array(["a", "b"]).dictionary_encode())), "type dictionary"),
        (stream(batch(x=pa.array([0] * (MAX_ROWS + 1), pa.int8()))), "rows"),
        (stream(batch(x=pa.array([b""] * 3, pa.binary(0)))), "fixed_size_binary"),
        (stream(pa.record_batch({f"c{n}": pa.array([1]) for n in range(1001)})), "columns"),
        (stream(batch(x=pa.array([[[[[[[[1]]]]]]]]))), "nested"),
        (pa.py_buffer(b""), "found less"),
    ],
)
def test_what_could_be_larger_than_it_looks_is_refused(content: pa.Buffer, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_record_batch(content)


def test_a_message_cannot_claim_to_unpack_to_any_size() -> None:
    for size in (MAX_MESSAGE + 1, 2**62, 256 * 5):
        sizes = b"\x18" + _varint(size)
        payload = b"\x0a\x02\x08\x01" + b"\x10\x02" + sizes + b"\x20\x01" + b"\x2a\x05aaaaa"
        with pytest.raises(ValueError, match="cannot unpack"):
            decode_chunk(memoryview(payload))


@pytest.mark.parametrize("content", [b"\x0a\x05ab", b"\x07", b"\x80" * 11, b"\x08", b"\x0b"])
def test_a_damaged_envelope_is_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        read_fields(memoryview(content))


def test_a_wrong_length_is_named_and_does_not_shorten(recorded: Recorded, tmp_path: Path) -> None:
    """Kind and length of some messages are changed: no such file is read, and each error names a byte."""
    whole = recorded[0].read_bytes()
    with recorded[0].open("rb") as file:
        starts = [frame.start - 16 for frame in read_message_spans(file, len(whole)) if frame.kind == CHUNK]
    path = tmp_path / "wrong.rrd"
    for start in starts[::25]:
        kind, length = struct.unpack_from("<QQ", whole, start)
        for other in ((0, length), (kind, 0), (kind, length - 1), (kind, 2**63), (9, length), (1, length)):
            path.write_bytes(whole[:start] + struct.pack("<QQ", *other) + whole[start + 16 :])
            with pytest.raises(SessionError, match=r"wrong\.rrd: .*byte \d+"):
                read_session(path)


def test_rows_of_another_recording_are_not_left_out(tmp_path: Path) -> None:
    """In a session without checksums and index, which would name another problem first."""
    sample = SAMPLES / "ant.rrd"
    data = bytearray(sample.read_bytes())
    with sample.open("rb") as file:
        last = [frame for frame in read_message_spans(file, len(data)) if frame.kind == CHUNK][-1]
    data[data.index(b"pdtui", last.start)] ^= 1
    (tmp_path / "other.rrd").write_bytes(data)
    with pytest.raises(SessionError, match="does not announce"):
        read_session_header(tmp_path / "other.rrd")


def test_a_damaged_index_is_noticed(recorded: Recorded, tmp_path: Path) -> None:
    data = bytearray(recorded[0].read_bytes())
    for place in (len(data) - 40, len(data) - 20, len(data) - 5):
        damaged = bytearray(data)
        damaged[place] ^= 4
        (tmp_path / "index.rrd").write_bytes(damaged)
        with pytest.raises(SessionError, match=r"index is damaged|end is said"):
            read_session(tmp_path / "index.rrd")


def test_a_pipe_is_no_session(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.rrd")
    with pytest.raises(SessionError, match=r"pipe\.rrd: cannot be read: expected a regular file"):
        read_session(tmp_path / "pipe.rrd")


def test_reading_does_not_load_rerun(recorded: Recorded) -> None:
    code = (
        "import sys; from pdtui.sessions.session_reader import read_session; read_session(sys.argv[1]); "
        "print('rerun' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, recorded[0]], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.strip() == "False"


def _varint(value: int) -> bytes:
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return bytes([*found, value])
