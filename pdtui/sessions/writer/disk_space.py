"""How much a recording may still grow: on a full disk, it has to end while its end still fits.

The library writes in a thread of its own. What fails there is said at the second flush after it, or, where
nobody waits for flushes, never. So the room is looked at before rows are handed over.
"""

from __future__ import annotations

import os
import resource
from pathlib import Path

_SLACK = 1_000_000
_FOOTER_OF_CHUNK = 256
"""The footer lists all chunks, at 150 to 200 bytes each."""

_PICTURE_COLUMNS = 768
_AT_LEAST_A_STEP = 2000


def free_space(path: Path) -> int:
    """Bytes by which a file may grow: what its disk has left, and the process's limit on a file's size.

    Raises:
        OSError: no such file.
    """
    disk = os.statvfs(path)
    free = disk.f_bavail * disk.f_frsize
    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    if limit == resource.RLIM_INFINITY:
        return free
    return min(free, max(0, limit - path.stat().st_size))


def is_full(path: Path) -> bool:
    """Whether a write that failed did so for lack of room."""
    try:
        return free_space(path) < _SLACK
    except OSError:
        return False


class DiskReserve:
    """Keeps account of what a recording needs to end whole.

    Args:
        path: the recording.
        units: hidden units, for the picture of all activations.
        rows: control steps that may be on their way to the file.
    """

    def __init__(self, path: Path, units: int, rows: int) -> None:
        self._path, self._rows = path, rows
        self._fixed = _SLACK + _PICTURE_COLUMNS * units
        self._least = _AT_LEAST_A_STEP + 8 * units

    @property
    def to_begin(self) -> int:
        """Bytes without which no recording is begun."""
        return self._fixed + self._least * self._rows

    def needed(self, steps: int, chunks: int) -> int:
        """Bytes for the rows on their way, the picture, the outcome and the footer.

        Args:
            steps: control steps so far; they tell how large one is.
            chunks: that were written so far.
        """
        step = max(self._least, 2 * self._path.stat().st_size // max(steps, self._rows))
        return self._fixed + _FOOTER_OF_CHUNK * chunks + step * self._rows

    def is_short(self, steps: int, chunks: int) -> bool:
        """Whether no more than the recording's end still fits."""
        return free_space(self._path) < self.needed(steps, chunks)
