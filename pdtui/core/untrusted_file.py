"""Opening files that somebody sent: nothing but files, and no more of them than is bearable."""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from pathlib import Path


def open_regular_file(path: Path) -> BufferedReader:
    """Open a file for reading; a pipe or a device, which might never end, is refused.

    Raises:
        OSError: it cannot be opened, or is no file.
    """
    # A pipe without a writer would be waited for.
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(None, "expected a file, found something else", str(path))
    return os.fdopen(descriptor, "rb")


def read_bounded_file(path: Path, limit: int) -> bytes:
    """All bytes of a file.

    Args:
        path: the file.
        limit: bytes that it may have.

    Raises:
        OSError: it cannot be read, is no file, or is larger.
    """
    with open_regular_file(path) as file:
        content = file.read(limit + 1)
    if len(content) > limit:
        raise OSError(None, f"expected at most {limit} bytes, the file has more", str(path))
    return content
