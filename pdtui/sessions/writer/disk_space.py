"""Measure the disk space that a recording has left, so that it can be ended before the disk is full.

The library writes in a separate thread. A failure there is reported by the second flush after it, or never if
nobody waits for flushes. The space is therefore checked before rows are handed over.
"""

from __future__ import annotations

import os
import resource
from pathlib import Path

from rich import filesize

from pdtui.core.errors import SessionError

_SLACK = 1_000_000
"""Space that is always left free, bytes: other programs write to the disk, too."""
_FOOTER_OF_CHUNK = 256
"""Size of a chunk's entry in the index at the end of the file, bytes; measured were 150 to 200."""

_PICTURE_COLUMNS = 768
"""Width of the heat map of all activations; it has one byte per unit and column."""
_LEAST_STEP_BYTES = 2000
"""Smallest size that is assumed of a control step, bytes, besides its activations."""


def free_space(path: Path) -> int:
    """Return by how many bytes a file can grow: the free space, within the limit on the size of files."""
    disk = os.statvfs(path)
    free = disk.f_bavail * disk.f_frsize
    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    if limit == resource.RLIM_INFINITY:
        return free
    return min(free, max(0, limit - path.stat().st_size))


def is_disk_full(path: Path) -> bool:
    """Return whether a failed write was due to a full disk."""
    try:
        return free_space(path) < _SLACK
    except OSError:
        return False


class DiskReserve:
    """Computes the space that a recording needs to be ended properly.

    Args:
        path: the recording.
        units: number of hidden units, which the heat map of all activations depends on.
        rows: number of control steps that may be on their way to the file.
    """

    def __init__(self, path: Path, units: int, rows: int) -> None:
        self._path, self._rows = path, rows
        self._fixed = _SLACK + _PICTURE_COLUMNS * units
        self._least = _LEAST_STEP_BYTES + 8 * units

    def require_space_to_begin(self) -> None:
        """Create the recording's folder and check that there is space to begin the recording.

        A full disk and a folder that cannot be written are a `SessionError`.
        """
        needed = self._fixed + self._least * self._rows
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            free = free_space(self._path.parent)
        except OSError as error:
            raise SessionError(f"{self._path}: cannot be written: {error.strerror}") from error
        if free < needed:
            raise SessionError(
                f"{self._path}: cannot be written: the disk is full: {filesize.decimal(free)} are free, "
                f"a recording needs {filesize.decimal(needed)} to begin"
            )

    def is_short(self, steps: int, chunks: int) -> bool:
        """Return whether there is space only for the rows on their way, the heat map, outcome and index.

        The size of a step is estimated from the control steps, and that of the index from the chunks so far.
        """
        step = max(self._least, 2 * self._path.stat().st_size // max(steps, self._rows))
        needed = self._fixed + _FOOTER_OF_CHUNK * chunks + step * self._rows
        return free_space(self._path) < needed
