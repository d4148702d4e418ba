"""Zip archives from untrusted sources: sizes are checked before anything is unpacked."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import read_bounded_file

MAX_BYTES = 1 << 30
_MAX_ENTRIES = 20_000
_SHOWN = 8
_DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, OSError)


class ZipArchive:
    """The entries of a zip file; one that is damaged or would unpack to too many bytes is a `PolicyError`."""

    def __init__(self, content: bytes, source: str) -> None:
        self.source = source
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
            raise PolicyError(f"{source}: a zip file that is cut off or damaged: {error}") from error
        if min((info.header_offset for info in self._zip.infolist()), default=0) > 0:
            # The directory found is that of an archive inside; the file's own is missing.
            raise PolicyError(
                f"{source}: a zip file that is cut off or damaged: it has no directory of its own"
            )
        self._entries = {info.filename: info for info in self._zip.infolist()}
        self.names: tuple[str, ...] = tuple(self._entries)
        total = sum(info.file_size for info in self._entries.values())
        if len(self.names) > _MAX_ENTRIES or total > MAX_BYTES:
            raise PolicyError(
                f"{source}: expected at most {_MAX_ENTRIES} entries of {MAX_BYTES >> 20} MiB in all; the zip "
                f"would unpack to {len(self.names)} entries of {total >> 20} MiB"
            )

    def read(self, name: str) -> bytes:
        """Unpack one entry, but no more bytes than the archive's directory states."""
        if name not in self._entries:
            raise PolicyError(f"{self.source}: no entry '{name}'; available: {self.listing()}")
        size = self._entries[name].file_size
        try:
            with self._zip.open(name) as stream:
                content = stream.read(size + 1)
        except _DAMAGED as error:
            raise PolicyError(f"{self.source}: entry '{name}' cannot be unpacked: {error}") from error
        if len(content) != size:
            raise PolicyError(
                f"{self.source}: entry '{name}': expected {size} bytes, found {len(content)}: it is damaged"
            )
        return content

    def listing(self) -> str:
        """List the entries for messages."""
        return shorten_name_list(self.names)


def shorten_name_list(names: tuple[str, ...] | list[str]) -> str:
    """List the first names and how many more there are, all printable."""
    shown = [name if name.isprintable() else ascii(name) for name in names[:_SHOWN]]
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (", ".join(name[:80] for name in shown) or "nothing") + more


def read_file_bytes(path: Path) -> bytes:
    """Return the content of a file; one that cannot be read or is too large is a `PolicyError`."""
    try:
        return read_bounded_file(path, MAX_BYTES)
    except OSError as error:
        raise PolicyError(f"{path}: cannot be read: {error.strerror}") from error
