"""The file of a session: created exclusively, locked, and found again if it is renamed or deleted."""

from __future__ import annotations

import fcntl
import os
from contextlib import nullcontext, suppress
from itertools import count
from pathlib import Path
from typing import BinaryIO, Literal, get_args

from pdtui.core.errors import SessionError

ExistingFile = Literal["refuse", "number", "replace"]
"""What to do if a file of the name exists: refuse, append a number to the name, or replace it at the end."""

SyncMode = Literal["off", "batch", "full"]
"""When data are forced to the disk: never; in the background, about once a second; or with every write.

A killed process loses nothing in any mode. A power failure may take what was not forced to the disk: with
``off``, what the operating system has not written by itself, on Linux up to about 30 s; with ``batch``, about
the last second; with ``full``, nothing that was written.
"""

SYNC_MODES: tuple[SyncMode, ...] = get_args(SyncMode)

_COPY_BYTES = 1 << 20


class SessionFile:
    """The file of a session. Until it is created, what is written is kept in memory.

    A drive that ends before its first control step therefore leaves no file.

    Args:
        path: where the file shall be.
        existing: what to do if a file of this name exists.
        sync: when data are forced to the disk.

    Attributes:
        path: where the file is, or will be.
        size: number of bytes written.
        on_disk: whether the file was created.

    Raises:
        SessionError: the file exists and is to be refused, or is being recorded.
    """

    def __init__(self, path: Path, existing: ExistingFile = "refuse", sync: SyncMode = "batch") -> None:
        self.path, self._existing, self._sync = path, existing, sync
        self._replaced: BinaryIO | None = None
        self._descriptor = -1
        self._waiting = bytearray()
        self._unsynchronized = False
        self.size = 0
        self.on_disk = False
        if os.path.lexists(path):
            if existing == "refuse" or not path.is_file():
                raise SessionError(f"{path}: already exists; a drive is recorded into a new file")
            if existing == "replace":
                self._replaced = _lock_file_to_replace(path)

    def create(self) -> None:
        """Create the file, and write what was kept in memory; an `OSError` says that it cannot be created."""
        if self._replaced is not None:
            self.path = self.path.with_name(f"{self.path.stem}.new{self.path.suffix}")
        numbered = self._existing == "number" or self._replaced is not None
        self._descriptor, self.path = _create(self.path, numbered=numbered)
        self.on_disk = True
        waiting, self._waiting = bytes(self._waiting), bytearray()
        self.size = 0
        self.write(waiting)
        self._synchronize_folder()

    def write(self, data: bytes) -> None:
        """Write whole messages; after a failure, which is an `OSError`, the file ends with those before."""
        if self._descriptor < 0:
            self._waiting += data
            self.size += len(data)
            return
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self.size)
                os.lseek(self._descriptor, self.size, os.SEEK_SET)
            raise
        self.size += len(data)
        self._unsynchronized = True
        if self._sync == "full":
            self.synchronize()

    def synchronize(self) -> None:
        """Force what was written to the disk, unless the mode is ``off``."""
        if self._unsynchronized and self._sync != "off" and self._descriptor >= 0:
            self._unsynchronized = False
            os.fdatasync(self._descriptor)

    def follow_renamed_file(self) -> str:
        """Find out whether the file is still where it was, and return one line if it is not.

        A file that was renamed is followed. One that was deleted is written again, under a new name, from
        what the operating system still holds. An `OSError` says that this is impossible.
        """
        if self._descriptor < 0:
            return ""
        own = os.fstat(self._descriptor)
        with suppress(FileNotFoundError):
            there = self.path.stat()
            if (there.st_dev, there.st_ino) == (own.st_dev, own.st_ino):
                return ""
        before = self.path
        moved = _path_of_descriptor(self._descriptor) if own.st_nlink else None
        if moved is not None:
            self.path = moved
            return f"{before} was renamed: the recording goes on in {moved}"
        self._copy_to_new_file()
        return f"{before} was deleted: the recording goes on in {self.path}, which has all of it"

    def finish(self, *, whole: bool) -> None:
        """Close the file; if it is whole, it replaces the file that it was to replace."""
        replaced, self._replaced = self._replaced, None
        with replaced or nullcontext():
            self._finish(None if replaced is None or not whole else Path(replaced.name))

    def _finish(self, replaced: Path | None) -> None:
        if self._descriptor < 0:
            return
        self._unsynchronized = True
        self.synchronize()
        if replaced is not None:
            self.path.replace(replaced)
            self.path = replaced
            self._synchronize_folder()
        os.close(self._descriptor)
        self._descriptor = -1

    def _copy_to_new_file(self) -> None:
        copy, path = _create(self.path, numbered=True)
        place = 0
        while place < self.size:
            block = os.pread(self._descriptor, min(_COPY_BYTES, self.size - place), place)
            if not block:
                raise OSError(None, "what was recorded cannot be read again")
            os.write(copy, block)
            place += len(block)
        os.close(self._descriptor)
        self._descriptor, self.path = copy, path
        self._synchronize_folder()

    def _synchronize_folder(self) -> None:
        """Force the name of the file to the disk."""
        if self._sync != "off":
            folder = os.open(self.path.parent, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)


def is_being_recorded(path: Path) -> bool:
    """Return whether another process, or another recorder, is writing a session into a file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # the file system has no locks
        return False
    else:
        return False
    finally:
        os.close(descriptor)


def _lock_file_to_replace(path: Path) -> BinaryIO:
    """Open and lock a file so that no other recording can replace it until it is closed."""
    try:
        file = path.open("rb")
    except OSError as error:
        raise SessionError(f"{path}: cannot be replaced: {error.strerror}") from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        there = path.stat()
        if (there.st_dev, there.st_ino) == (os.fstat(file.fileno()).st_dev, os.fstat(file.fileno()).st_ino):
            return file
    except (BlockingIOError, FileNotFoundError):
        pass
    except OSError:  # the file system has no locks
        return file
    file.close()
    raise SessionError(f"{path}: cannot be replaced: it is being recorded")


def _create(path: Path, *, numbered: bool) -> tuple[int, Path]:
    """Create and lock a new file; if its name is taken and may be `numbered`, append a free number."""
    path.parent.mkdir(parents=True, exist_ok=True)
    for number in count(1):
        place = path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")
        try:
            descriptor = os.open(place, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        except FileExistsError:
            if not numbered:
                raise
            continue
        with suppress(OSError):  # the file system has no locks
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return descriptor, place
    raise AssertionError


def _path_of_descriptor(descriptor: int) -> Path | None:
    """Return where an open file is now; None if the system does not tell."""
    try:
        place = Path(f"/proc/self/fd/{descriptor}").readlink()
        there, own = place.stat(), os.fstat(descriptor)
    except OSError:
        return None
    return place if (there.st_dev, there.st_ino) == (own.st_dev, own.st_ino) else None
