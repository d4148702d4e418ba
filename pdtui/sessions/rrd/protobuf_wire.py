"""Protobuf's wire format, as far as an .rrd file needs it; a `ValueError` says what is damaged."""

from __future__ import annotations

from collections.abc import Iterator

_VARINT, _EIGHT, _BYTES, _FOUR = 0, 1, 2, 5
_VARINT_BYTES = 10
Value = int | memoryview


def read_fields(message: memoryview, *, cut: bool = False) -> dict[int, Value]:
    """Return the fields of a message by their numbers; of a repeated field, the last.

    Numbers are decoded; every other field is returned as its bytes. If only the start of the message is there
    (`cut`), the last field may be incomplete.
    """
    return dict(iterate_fields(message, cut=cut))


def iterate_fields(message: memoryview, *, cut: bool = False) -> Iterator[tuple[int, Value]]:
    """Yield number and content of the fields of a message in their order, as `read_fields` returns them."""
    place = 0
    while place < len(message):
        tag, place = _read_varint(message, place)
        kind = tag & 7
        if kind == _VARINT:
            value, place = _read_varint(message, place)
            yield tag >> 3, value
            continue
        if kind == _BYTES:
            length, place = _read_varint(message, place)
        elif kind in (_EIGHT, _FOUR):
            length = 8 if kind == _EIGHT else 4
        else:
            raise ValueError(f"unknown wire type {kind}")
        if place + length > len(message) and not cut:
            raise ValueError(f"a field of {length} bytes, {len(message) - place} are left")
        yield tag >> 3, message[place : place + length]
        place += length


def protobuf_number_field(found: dict[int, Value], field: int) -> int:
    """Return a numeric field; 0 if it is missing, which is the default of the format."""
    value = found.get(field, 0)
    if not isinstance(value, int):
        raise ValueError(f"field {field} is not a number")
    return value


def protobuf_bytes_field(found: dict[int, Value], field: int) -> memoryview:
    """Return the bytes of a field that is a text, a message or bytes; empty if it is missing."""
    value = found.get(field, memoryview(b""))
    if isinstance(value, int):
        raise ValueError(f"field {field} is a number")
    return value


def protobuf_text_field(found: dict[int, Value], field: int) -> str:
    """Return a text field; empty if it is missing."""
    return str(protobuf_bytes_field(found, field), "utf-8")


def _read_varint(message: memoryview, place: int) -> tuple[int, int]:
    value = 0
    for shift in range(_VARINT_BYTES):
        if place >= len(message):
            raise ValueError("a number is cut")
        byte = message[place]
        place += 1
        value |= (byte & 0x7F) << (7 * shift)
        if byte < 0x80:
            return value, place
    raise ValueError("a number is too long")


def encode_varint(value: int) -> bytes:
    """Encode a number that is not negative."""
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*encoded, value])


def encode_tag(field: int, length: int) -> bytes:
    """Encode what precedes the content of a field of `length` bytes."""
    return encode_varint(field << 3 | _BYTES) + encode_varint(length)


def encode_bytes_field(field: int, content: bytes | memoryview) -> bytes:
    """Encode a field that is a text, a message or bytes."""
    return encode_tag(field, len(content)) + bytes(content)


def encode_number_field(field: int, value: int) -> bytes:
    """Encode a numeric field."""
    return encode_varint(field << 3 | _VARINT) + encode_varint(value)
