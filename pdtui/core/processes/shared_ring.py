"""A ring of messages in memory that two processes share: one writes, the other reads.

Writing needs no system call and wakes nobody, so it costs the writer a copy. What was written survives the
death of the writer.
"""

from __future__ import annotations

import mmap
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Self

from pdtui.core.closable import Closable

_HEADER = 64
_WRITTEN, _READ, _NOTICES, _READER_VALUE = 0, 1, 2, 3
_LENGTH = 8
_SKIP = (1 << 64) - 1
_SHARED_MEMORY = Path("/dev/shm")
"""Where Linux keeps files in memory."""


class SharedRing(Closable):
    """The ring, in the process that created it or in the one that opened it.

    Positions only grow; a message is there once the position of the writer is beyond it. Each position is
    written by one process alone, in one piece of eight bytes.

    Args:
        path: the file that both map into their memory; `create` makes one.

    Attributes:
        path: the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), 0)
        self._view = memoryview(self._memory)
        self._fields = self._view[:_HEADER].cast("Q")
        self._data = self._view[_HEADER:]
        self._size = len(self._data)

    @classmethod
    def create(cls, size: int) -> Self:
        """Create a ring for messages of this many bytes together, a multiple of eight."""
        for folder in (_SHARED_MEMORY, Path(tempfile.gettempdir())):
            try:
                descriptor, name = tempfile.mkstemp(prefix="pdtui-", suffix=".ring", dir=folder)
            except OSError:
                continue
            try:
                # Without space, writing into the memory would end the process.
                os.posix_fallocate(descriptor, 0, _HEADER + size)
                return cls(Path(name))
            except OSError:
                Path(name).unlink(missing_ok=True)
                if folder != _SHARED_MEMORY:
                    raise
            finally:
                os.close(descriptor)
        raise OSError(None, "there is no folder for temporary files")

    def unlink(self) -> None:
        """Remove the name of the file; processes that have opened it keep the memory."""
        self.path.unlink(missing_ok=True)

    @property
    def largest_message(self) -> int:
        """Size of the largest message that the ring can take, bytes."""
        return self._size // 2 - _LENGTH

    def write(self, message: bytes) -> bool:
        """Write a message, or return False if there is no space until the reader has read on."""
        fields, size = self._fields, self._size
        written, room = fields[_WRITTEN], size - (fields[_WRITTEN] - fields[_READ])
        place, length = written % size, len(message)
        needed = _LENGTH + (length + 7) // 8 * 8
        skipped = size - place if size - place < needed else 0
        if skipped + needed > room:
            return False
        if skipped:
            self._data[place : place + _LENGTH] = _SKIP.to_bytes(_LENGTH, "little")
            place = 0
        start = place + _LENGTH
        self._data[place:start] = length.to_bytes(_LENGTH, "little")
        self._data[start : start + length] = message
        fields[_WRITTEN] = written + skipped + needed
        return True

    def read(self) -> bytes | None:
        """Return the next message, or None if there is none."""
        fields, size = self._fields, self._size
        while fields[_READ] != fields[_WRITTEN]:
            place = fields[_READ] % size
            length = int.from_bytes(self._data[place : place + _LENGTH], "little")
            if length == _SKIP:
                fields[_READ] += size - place
                continue
            start = place + _LENGTH
            message = bytes(self._data[start : start + length])
            fields[_READ] += _LENGTH + (length + 7) // 8 * 8
            return message
        return None

    @property
    def notice_count(self) -> int:
        """A number that the reader counts up and the writer looks at, so that it knows of news elsewhere."""
        return self._fields[_NOTICES]

    def increment_notice_count(self) -> None:
        """Count up the number of notices."""
        self._fields[_NOTICES] += 1

    @property
    def reader_value(self) -> int:
        """A number that the reader sets for the writer."""
        return self._fields[_READER_VALUE]

    @reader_value.setter
    def reader_value(self, value: int) -> None:
        self._fields[_READER_VALUE] = value

    def close(self) -> None:
        for view in (self._fields, self._data, self._view):
            view.release()
        with suppress(BufferError):
            self._memory.close()
