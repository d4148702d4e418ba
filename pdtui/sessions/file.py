"""An .rrd file as a stream of chunks; whatever is wrong with it becomes a `SessionError`."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
from rerun.chunk import Chunk, RrdReader

from pdtui.errors import SessionError
from pdtui.sessions.chunks import Rows
from pdtui.sessions.schema import APP, DRIVE, STEP, VIEWS

_MAGIC = b"RRF2"
_PROPERTIES = "/__properties/"
_TORN = ("exceeds file size", "too small", "byte payload, above")
_UNREADABLE = (RuntimeError, ValueError, OSError, pa.ArrowException)


class SessionFile:
    """An .rrd of pdtui, read once from its beginning to its end.

    Args:
        path: the file.
        only: components of the drive to keep; all if empty.
        skip: components of the drive to leave out.
        torn: read up to the first chunk that cannot be read, instead of raising.
        called: what errors call the file, where `path` is a copy.

    Attributes:
        recording_id: of the recording.
        complete: whether every chunk could be read.

    Raises:
        SessionError: no such file, not a recording, another program's, or torn.
    """

    def __init__(
        self,
        path: Path,
        *,
        only: Sequence[str] = (),
        skip: Sequence[str] = (),
        torn: bool = False,
        called: Path | None = None,
    ) -> None:
        called = called or path
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self._properties: dict[str, dict[str, list[Any]]] = {}
        self.complete = True
        self._reader, self.recording_id = _open(path, called)
        try:
            for chunk in _chunks(self._reader, called):
                self._take(chunk, only, skip)
        except SessionError:
            if not torn:
                raise
            self.complete = False

    def properties(self, name: str) -> dict[str, list[Any]]:
        """Values of one group of properties, by name; empty if the file has none."""
        return self._properties.get(name, {})

    def rows(self, entity: str) -> Rows:
        """All rows of an entity; none if the file has none."""
        return Rows(entity, self._batches.get(entity, []))

    def has_footer(self) -> bool:
        """Whether the file ends as a finished one does, with an index of its chunks."""
        try:
            self._reader.store()
        except _UNREADABLE:
            return False
        return True

    def _take(self, chunk: Chunk, only: Sequence[str], skip: Sequence[str]) -> None:
        entity = chunk.entity_path
        if entity.startswith(_PROPERTIES):
            batch = chunk.to_record_batch()
            group = self._properties.setdefault(entity.removeprefix(_PROPERTIES), {})
            for name in batch.schema.names:
                column = batch.column(name)
                if pa.types.is_list(column.type) and len(column) and column[-1].is_valid:
                    group[name] = column[-1].as_py()
        elif not chunk.is_static and not entity.startswith(VIEWS):
            batch = chunk.to_record_batch()
            if entity == DRIVE:
                names = [name for name in batch.schema.names if name not in skip]
                names = [name for name in names if not only or name in (STEP, *only)]
                batch = batch.select(names)
            self._batches.setdefault(entity, []).append(batch)


def readable_chunks(path: Path) -> Iterator[Chunk]:
    """The chunks of a recording up to the first that cannot be read; never more than a few are in memory.

    Raises:
        SessionError: no such file, not a recording, or another program's.
    """
    reader, _ = _open(path, path)
    try:
        yield from _chunks(reader, path)
    except SessionError:
        return


def _open(path: Path, called: Path) -> tuple[RrdReader, str]:
    _check_magic(path, called)
    with _reading(called):
        reader = RrdReader(path)
        stores = reader.recordings()
    if not stores:
        raise SessionError(f"{called}: holds no recording")
    if stores[0].application_id != APP:
        raise SessionError(
            f"{called}: expected a recording of {APP}, found one of '{stores[0].application_id[:60]}'"
        )
    return reader, stores[0].recording_id


def _chunks(reader: RrdReader, path: Path) -> Iterator[Chunk]:
    with _reading(path):
        stream = iter(reader.stream())
    while True:
        with _reading(path):
            chunk = next(stream, None)
        if chunk is None:
            return
        yield chunk


def _check_magic(path: Path, called: Path) -> None:
    try:
        with path.open("rb") as handle:
            magic = handle.read(len(_MAGIC))
    except FileNotFoundError:
        raise SessionError(f"{called}: no such file") from None
    except OSError as error:
        raise SessionError(f"{called}: cannot be read: {error.strerror}") from error
    if magic != _MAGIC:
        raise SessionError(f"{called}: expected a Rerun recording (.rrd), found another kind of file")


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        with warnings.catch_warnings():
            # A session that was killed has no footer; that is no news to its reader.
            warnings.simplefilter("ignore")
            yield
    except _UNREADABLE as error:
        if any(sign in str(error) for sign in _TORN):
            raise SessionError(
                f"{path}: the file is torn: its last message is cut; "
                "`pdtui sessions repair` rescues what is before it"
            ) from error
        raise SessionError(f"{path}: cannot be read as a recording: {error}") from error
