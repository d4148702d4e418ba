"""Open files from untrusted sources: regular files only, and with a limit on their size."""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from pathlib import Path


def open_regular_file(path: Path) -> BufferedReader:
    """Open a regular file for reading; pipes and devices, which might never end, are an `OSError`."""
    # Without O_NONBLOCK, opening a pipe would wait for a writer.
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(None, "expected a regular file, found something else", str(path))
    return os.fdopen(descriptor, "rb")


def read_bounded_file(path: Path, limit: int) -> bytes:
    """Read all bytes of a regular file; one of more than `limit` bytes is an `OSError`."""
    with open_regular_file(path) as file:
        content = file.read(limit + 1)
    if len(content) > limit:
        raise OSError(None, f"expected at most {limit} bytes, found more", str(path))
    return content
