"""The kind of a file, told by its first bytes and not by its name."""

from __future__ import annotations

from enum import Enum


class FileKind(Enum):
    """Kinds of files, with their descriptions for messages."""

    ZIP = "a zip archive"
    SAFETENSORS = "safetensors"
    PICKLE = "a pickle"
    HDF5 = "HDF5, such as Keras writes"
    GZIP = "a gzip file"
    ONNX = "ONNX"
    EMPTY = "an empty file"
    UNKNOWN = "no format that pdtui knows"


def file_kind_of(content: bytes) -> FileKind:
    """Return the kind of a file with this content."""
    if not content:
        return FileKind.EMPTY
    if content.startswith(b"PK\x03\x04") or content.startswith(b"PK\x05\x06"):
        return FileKind.ZIP
    if content.startswith(b"\x89HDF"):
        return FileKind.HDF5
    if content.startswith(b"\x1f\x8b"):
        return FileKind.GZIP
    if content[8:9] == b"{" and 0 < int.from_bytes(content[:8], "little") < len(content):
        return FileKind.SAFETENSORS
    # Pickles of protocol 2 and later say so; older ones are text that ends in a full stop.
    if content[:1] == b"\x80" and content[1:2] in b"\x02\x03\x04\x05":
        return FileKind.PICKLE
    if content[:1] in b"(c]})l" and content.rstrip().endswith(b".") and content[:1] != b"{":
        return FileKind.PICKLE
    if content[:1] == b"\x08" and b"onnx" in content[:200].lower():
        return FileKind.ONNX
    return FileKind.UNKNOWN
