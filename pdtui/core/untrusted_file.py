"""Files from untrusted sources: what reading one may take, and how to open it.

`FILE_BUDGETS` states the limits of every kind of file that pdtui reads; the guide's table of files from other
people is made from it.
"""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

KIB, MIB = 1 << 10, 1 << 20


@dataclass(frozen=True)
class FileBudget:
    """What reading one file may take. All limits are far above any real file.

    Attributes:
        kind: The kind of file, in words.
        bytes: Size of the file; a larger one is refused before it is read.
        memory: Bytes of memory that reading takes at most, beyond what pdtui has when it begins.
        seconds: Processor time that reading takes at most, s.
        enforcement: What keeps memory and seconds within their limits.
    """

    kind: str
    bytes: int
    memory: int
    seconds: float
    enforcement: str


_OWN_PROCESS = "the system, for the process that reads the file"
_COUNTS = "limits on the size and on counts"
MAP_BUDGET = FileBudget("stimulation-evoked map", 256 * KIB, 64 * MIB, 3.0, _COUNTS)
KEYSTROKES_BUDGET = FileBudget("keystroke file", 4 * MIB, 128 * MIB, 3.0, _COUNTS)
WEIGHTS_BUDGET = FileBudget("weights that pdtui wrote", 128 * MIB, 512 * MIB, 3.0, "the size alone")
FOREIGN_POLICY_BUDGET = FileBudget("policy of another program", 64 * MIB, 384 * MIB, 2.0, _OWN_PROCESS)
STATISTICS_BUDGET = FileBudget("statistics of the observation", 4 * MIB, 384 * MIB, 2.0, _OWN_PROCESS)
FILE_BUDGETS = (MAP_BUDGET, KEYSTROKES_BUDGET, WEIGHTS_BUDGET, FOREIGN_POLICY_BUDGET, STATISTICS_BUDGET)


def open_regular_file(path: Path, limit: int | None = None) -> BufferedReader:
    """Open a regular file for reading; pipes and devices, which might never end, are an `OSError`.

    So is a file of more than `limit` bytes.
    """
    # Without O_NONBLOCK, opening a pipe would wait for a writer.
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | getattr(os, "O_NONBLOCK", 0))
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        os.close(descriptor)
        raise OSError(None, "expected a regular file, found something else", str(path))
    if limit is not None and status.st_size > limit:
        os.close(descriptor)
        raise _too_large(path, limit)
    return os.fdopen(descriptor, "rb")


def read_bounded_file(path: Path, limit: int) -> bytes:
    """Read all bytes of a regular file; one of more than `limit` bytes is an `OSError`."""
    with open_regular_file(path, limit) as file:
        content = file.read(limit + 1)
    if len(content) > limit:  # it has grown
        raise _too_large(path, limit)
    return content


def _too_large(path: Path, limit: int) -> OSError:
    return OSError(None, f"expected at most {describe_bytes(limit)}, found more", str(path))


def describe_bytes(count: int) -> str:
    """Return a number of bytes in words, such as ``64 MiB``."""
    return (
        f"{count // MIB} MiB" if count >= MIB else f"{count // KIB} KiB" if count >= KIB else f"{count} bytes"
    )
