"""Measure the disk space that a recording has left, so that it can be ended before the disk is full."""

from __future__ import annotations

import errno
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


def free_space(folder: Path, size: int) -> int:
    """Return by how many bytes a file of this size can grow: free space, within the limit on file sizes."""
    disk = os.statvfs(folder)
    free = disk.f_bavail * disk.f_frsize
    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    return free if limit == resource.RLIM_INFINITY else min(free, max(0, limit - size))


class DiskReserve:
    """Computes the space that a recording needs to be ended properly.

    Args:
        units: number of hidden units, which the heat map of all activations depends on.
        rows: number of control steps that may be on their way to the file.
    """

    def __init__(self, units: int, rows: int) -> None:
        self._rows = rows
        self._fixed = _SLACK + _PICTURE_COLUMNS * units
        self._least = _LEAST_STEP_BYTES + 8 * units

    def require_space_to_begin(self, path: Path) -> None:
        """Create a recording's folder and check that there is space to begin the recording.

        A full disk and a folder that cannot be written are a `SessionError`.
        """
        needed = self._fixed + self._least * self._rows
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if not os.access(path.parent, os.W_OK):
                raise PermissionError(None, os.strerror(errno.EACCES))
            free = free_space(path.parent, 0)
        except OSError as error:
            raise SessionError(f"{path}: cannot be written: {error.strerror}") from error
        if free < needed:
            raise SessionError(
                f"{path}: cannot be written: the disk is full: {filesize.decimal(free)} are free, "
                f"a recording needs {filesize.decimal(needed)} to begin"
            )

    def lacks_space(self, folder: Path, size: int, steps: int, chunks: int) -> bool:
        """Return whether there is space only for the rows on their way, the heat map, outcome and index.

        The size of a step is estimated from the control steps, and that of the index from the chunks so far,
        which took `size` bytes of a file in this folder.
        """
        step = max(self._least, 2 * size // max(steps, self._rows))
        needed = self._fixed + _FOOTER_OF_CHUNK * chunks + step * self._rows
        return free_space(folder, size) < needed
