"""Archives built byte by byte, since no library would write such ones."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Mapping

_CHUNK = 1 << 20


def zipped(entries: Mapping[str, bytes]) -> bytes:
    """Return a zip whose entries are stored as they are."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return stream.getvalue()


def zip_bomb(name: str, size: int, **others: bytes) -> bytes:
    """Return a zip with an entry of `size` zeros, in a thousandth of their space, and other entries."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for other, content in others.items():
            archive.writestr(other, content)
        with archive.open(name, "w", force_zip64=size >= 1 << 31) as entry:
            for _ in range(size // _CHUNK):
                entry.write(bytes(_CHUNK))
    return stream.getvalue()


def understated_zip(name: str, size: int, **others: bytes) -> bytes:
    """Return such a zip whose directory says that the entry has 1,000 bytes."""
    content = bytearray(zip_bomb(name, size, **others))
    directory = content.rindex(b"PK\x01\x02")
    struct.pack_into("<I", content, directory + 24, 1000)
    struct.pack_into("<I", content, content.rindex(b"PK\x03\x04") + 22, 1000)
    return bytes(content)


def npy(header: bytes, numbers: bytes = b"") -> bytes:
    """Return an array file with any header."""
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header + b"\n" + numbers


def safetensors_file(header: bytes, numbers: bytes = b"") -> bytes:
    """Return a safetensors file with any header."""
    return struct.pack("<Q", len(header)) + header + numbers


def _text(value: str) -> bytes:
    return b"X" + struct.pack("<I", len(value)) + value.encode()


def _sizes(values: tuple[int, ...]) -> bytes:
    return b"(" + b"".join(b"J" + struct.pack("<i", value) for value in values) + b"t"


def tensor_opcodes(shape: tuple[int, ...], stride: tuple[int, ...], stored: int) -> bytes:
    """Return what a pickle says for a tensor that claims a shape, over a storage of so many float32."""
    storage = b"(" + _text("storage") + b"ctorch\nFloatStorage\n" + _text("0") + _text("cpu")
    storage += b"J" + struct.pack("<i", stored) + b"tQ"
    return (
        b"ctorch._utils\n_rebuild_tensor_v2\n(" + storage + b"K\x00" + _sizes(shape) + _sizes(stride)
        + b"\x89ccollections\nOrderedDict\n)RtR"
    )  # fmt: skip


def _dictionary(entries: Mapping[str, bytes]) -> bytes:
    return b"}(" + b"".join(_text(name) + value for name, value in entries.items()) + b"u"


def state_dict(entries: Mapping[str, bytes], numbers: int = 1) -> bytes:
    """Return a PyTorch archive of a dictionary, whose values are given as a pickle's opcodes."""
    pickle = b"\x80\x02" + _dictionary(entries) + b"."
    return zipped({"a/data.pkl": pickle, "a/byteorder": b"little", "a/data/0": bytes(4 * numbers)})


def torchscript(code: str, attributes: Mapping[str, bytes] | None = None, numbers: int = 1) -> bytes:
    """Return a TorchScript archive whose module `Net` has attributes, given as a pickle's opcodes."""
    module = b"\x80\x02c__torch__\nNet\n)\x81" + _dictionary(attributes or {}) + b"b."
    entries = {"net/data.pkl": module, "net/data/0": bytes(4 * numbers), "net/constants.pkl": b"\x80\x02)."}
    return zipped(entries | {"net/code/__torch__.py": code.encode()})
