"""Where the messages of an .rrd begin and end, so that a torn tail can be left out.

A file is 12 bytes, then messages, each behind 16 bytes: its kind and its length. The last has kind 0 and is
followed by 32 bytes that point back to it. The library that reads messages refuses a file that ends in one.
"""

from __future__ import annotations

import shutil
import struct
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pdtui.errors import SessionError

_START, _TRAILER = 12, 32
_HEADER = struct.Struct("<QQ")
_LAST, _KINDS = 0, 4
_BLOCK = 1 << 20


def whole_length(path: Path) -> int:
    """Bytes up to which every message is whole; the file's size if all are.

    Only headers are read, so a message may claim any length.

    Raises:
        SessionError: the file cannot be read.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            place = min(_START, size)
            while True:
                file.seek(place)
                header = file.read(_HEADER.size)
                if len(header) < _HEADER.size:
                    return place
                kind, length = _HEADER.unpack(header)
                end = place + _HEADER.size + length
                if kind >= _KINDS or end > size:
                    return place
                if kind == _LAST:
                    return size if end + _TRAILER == size else place
                place = end
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error.strerror}") from error


@contextmanager
def without_torn_tail(path: Path) -> Iterator[Path]:
    """The file itself if its messages are whole, else a copy of those that are, for as long as this lasts.

    Raises:
        SessionError: the file cannot be read, or there is no space for the copy.
    """
    length = whole_length(path)
    if length == path.stat().st_size:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="pdtui-") as folder:
        copy = Path(folder) / "whole.rrd"
        try:
            with path.open("rb") as source, copy.open("wb") as target:
                shutil.copyfileobj(source, target, _BLOCK)
                target.truncate(length)
        except OSError as error:
            raise SessionError(f"{path}: cannot be copied to {folder}: {error.strerror}") from error
        yield copy
