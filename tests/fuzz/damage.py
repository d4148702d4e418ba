"""How files are damaged: bytes turned, cut, put in and moved; lengths changed; also inside what is packed."""

from __future__ import annotations

import io
import struct
import zipfile

import pyarrow as pa
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from pdtui.sessions.rrd.message_checksum import SEAL_BYTES, read_message_seal, seal_message
from pdtui.sessions.rrd.message_framing import HEADER_BYTES, LAST, START_BYTES, encode_last_message
from pdtui.sessions.rrd.protobuf_wire import protobuf_bytes_field, protobuf_number_field, read_fields

_LENGTHS = (0, 1, 7, 16, 255, 2**16, 2**31 - 1, 2**31, 2**32, 2**48, 2**62, 2**63, 2**64 - 1)
_WORDS = (
    b'"', b"\n", b"[", b"]]", b"{", b"= ", b"1e999", b"-nan", b"9" * 400, b"0x" + b"f" * 900, b"\x1b[2J",
    b"\xe2\x80\xae", b"../../etc/passwd", b"/dev/zero", b"\\ud800", b"\xff", b"null", b"-1", b"true",
)  # fmt: skip


class Content(bytes):
    """What is in a file; errors do not print it."""

    def __repr__(self) -> str:
        return f"Content of {len(self)} bytes"


@st.composite
def damaged(draw: DrawFn, content: Content) -> bytes:
    """The content with one to four things wrong with it."""
    data = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, max(0, len(data) - 1)))
        _damage(draw, data, place)
    return bytes(data)


def _damage(draw: DrawFn, data: bytearray, place: int) -> None:
    span = draw(st.integers(1, 40))
    match draw(st.integers(0, 6)):
        case 0 if data:
            data[place] ^= 1 << draw(st.integers(0, 7))
        case 1:
            data[place : place + 1] = bytes([draw(st.integers(0, 255))])
        case 2:
            del data[place:]
        case 3:
            del data[place : place + span]
        case 4:
            data[place:place] = draw(st.binary(min_size=1, max_size=40))
        case 5:
            other = draw(st.integers(0, max(0, len(data) - 1)))
            data[place:place] = data[other : other + 25 * span]
        case _:
            data[place:place] = draw(st.sampled_from(_WORDS))


@st.composite
def damaged_session(draw: DrawFn, content: Content) -> bytes:
    """As `damaged`; or with another length of a message, or with a message whose rows are damaged.

    Mostly with checksums that match all the same: they find accidents, and anyone can compute them.
    """
    kind = draw(st.integers(0, 3))
    if kind == 0:
        return draw(damaged(content))
    starts = _starts(content)
    start = draw(st.sampled_from(starts))
    if kind == 1:
        data = bytearray(content)
        which = draw(st.sampled_from((0, 8)))
        struct.pack_into("<Q", data, start + which, draw(st.sampled_from(_LENGTHS)))
        return bytes(data)
    length = struct.unpack_from("<QQ", content, start)[1]
    end = start + 16 + length
    payload = content[start + 16 : end]
    payload = _damaged_inside(draw, payload if read_message_seal(payload) is None else payload[:-SEAL_BYTES])
    kind_of_it = content[start : start + 8]
    rest = content[end:] if draw(st.booleans()) else b""
    changed = content[:start] + kind_of_it + struct.pack("<Q", len(payload)) + payload + rest
    return resealed(changed, start) if draw(st.integers(0, 3)) else changed


def resealed(content: bytes, bare: int = -1) -> bytes:
    """The session with checksums that match, so that what was damaged is read like what was recorded.

    The message at the byte `bare` has no checksum yet.
    """
    parts, place = [content[:START_BYTES]], START_BYTES
    previous: int | None = None
    while place + HEADER_BYTES <= len(content):
        kind, length = struct.unpack_from("<QQ", content, place)
        payload = content[place + HEADER_BYTES : place + HEADER_BYTES + length]
        if kind == LAST:
            parts.append(encode_last_message(payload, sum(map(len, parts))))
            break
        seal = read_message_seal(payload)
        if previous is None:
            previous = 0 if seal is None else seal.link
        if place != bare and seal is not None:
            payload = payload[:-SEAL_BYTES]
        header, end, previous = seal_message(kind, payload, previous)
        parts += [header, payload, end]
        place += HEADER_BYTES + length
    return b"".join(parts)


def damaged_weights(content: Content) -> SearchStrategy[bytes]:
    """As `damaged`, mostly in the header, which says what the rest is."""
    (length,) = struct.unpack_from("<Q", content)
    header, rest = Content(content[8 : 8 + length]), content[8 + length :]
    repacked = damaged(header).map(lambda changed: struct.pack("<Q", len(changed)) + changed + rest)
    return st.one_of(
        damaged(content), repacked, damaged(Content(content[: 8 + length])).map(lambda some: some + rest)
    )


@st.composite
def damaged_archive(draw: DrawFn, content: Content) -> bytes:
    """As `damaged`; mostly one entry inside the archive, so that the archive itself is whole."""
    if draw(st.integers(0, 4)) == 0:
        return draw(damaged(content))
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    name = draw(st.sampled_from(sorted(entries)))
    inner = Content(entries[name])
    entries[name] = draw(damaged_archive(inner) if inner.startswith(b"PK\3\4") else damaged(inner))
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, changed in entries.items():
            archive.writestr(name, changed)
    return stream.getvalue()


def _starts(content: bytes) -> list[int]:
    starts, place = [], 12
    while place + 16 <= len(content):
        starts.append(place)
        kind, length = struct.unpack_from("<QQ", content, place)
        if kind == 0:
            break
        place += 16 + length
    return starts


def _damaged_inside(draw: DrawFn, payload: bytes) -> bytes:
    """The message with rows that are damaged beneath their compression."""
    try:
        found = read_fields(memoryview(payload))
        packed, size = protobuf_bytes_field(found, 5), protobuf_number_field(found, 3)
        plain = pa.decompress(packed, size, codec="lz4_raw")
    except (ValueError, OSError, pa.ArrowException):
        return draw(damaged(Content(payload)))
    changed = draw(damaged(Content(plain)))
    parts = [
        _field(1, protobuf_bytes_field(found, 1)),
        b"\x10\x01",
        b"\x20\x01",
        _field(5, memoryview(changed)),
    ]
    return b"".join(parts)


def _field(number: int, content: memoryview) -> bytes:
    return bytes([number << 3 | 2]) + _varint(len(content)) + bytes(content)


def _varint(value: int) -> bytes:
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return bytes([*found, value])
