"""Zip archives from untrusted sources: sizes are checked before anything is unpacked."""

from __future__ import annotations

import io
import zipfile
import zlib

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import MIB

_MAX_ENTRIES = 20_000
_SHOWN = 8
_DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, OSError, ValueError)


class ZipArchive:
    """The entries of a zip file; one that is damaged or would unpack to too many bytes is a `PolicyError`.

    Args:
        content: The file.
        limit: Bytes that all entries together may unpack to.
    """

    def __init__(self, content: bytes, limit: int) -> None:
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except _DAMAGED as error:
            raise PolicyError(f"a zip file that is cut off or damaged: {error}") from error
        if min((info.header_offset for info in self._zip.infolist()), default=0) > 0:
            # The directory found is that of an archive inside; the file's own is missing.
            raise PolicyError("a zip file that is cut off or damaged: it has no directory of its own")
        self._entries = {info.filename: info for info in self._zip.infolist()}
        self.names: tuple[str, ...] = tuple(self._entries)
        self.limit = limit
        total = sum(info.file_size for info in self._entries.values())
        if len(self.names) > _MAX_ENTRIES or total > limit:
            raise PolicyError(
                f"expected at most {_MAX_ENTRIES} entries of {limit // MIB} MiB in all; the zip would unpack "
                f"to {len(self.names)} entries of {total // MIB} MiB"
            )

    @property
    def compressed(self) -> bool:
        """Whether an entry is compressed."""
        return any(info.compress_type != zipfile.ZIP_STORED for info in self._entries.values())

    def read(self, name: str, limit: int | None = None) -> bytes:
        """Unpack one entry of at most `limit` bytes, no more of it than the directory states."""
        if name not in self._entries:
            raise PolicyError(f"no entry '{name}'; available: {self.listing()}")
        size = self._entries[name].file_size
        if limit is not None and size > limit:
            raise PolicyError(f"entry '{name}': expected at most {limit} bytes, found {size}")
        try:
            with self._zip.open(name) as stream:
                content = stream.read(size + 1)
        except _DAMAGED as error:
            raise PolicyError(f"entry '{name}' cannot be unpacked: {error}") from error
        if len(content) != size:
            raise PolicyError(f"entry '{name}': expected {size} bytes, found {len(content)}: it is damaged")
        return content

    def listing(self) -> str:
        """List the entries for messages."""
        return shorten_name_list(self.names)


def shorten_name_list(names: tuple[str, ...] | list[str]) -> str:
    """List the first names and how many more there are, all printable."""
    shown = [name if name.isprintable() else ascii(name) for name in names[:_SHOWN]]
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (", ".join(name[:80] for name in shown) or "nothing") + more
