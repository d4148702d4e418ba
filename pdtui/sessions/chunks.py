"""The chunks of a recording, gathered into columns whose types and lengths are known to be right."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from rerun.chunk import Chunk, RrdReader

from pdtui.errors import SessionError
from pdtui.sessions.schema import APP, DRIVE, STEP, VIEWS

Number = TypeVar("Number", bound=np.generic)
_MAGIC = b"RRF2"
_PROPERTIES = "/__properties/"


class Rows:
    """All rows of one entity, in the order of their steps."""

    def __init__(self, entity: str, batches: Sequence[pa.RecordBatch]) -> None:
        self._entity, self._batches = entity, batches
        steps = [self._step_column(batch) for batch in batches]
        unsorted = np.concatenate(steps) if steps else np.empty(0, np.int64)
        # Tools that rewrite a recording may change the order of its chunks.
        self._order = np.argsort(unsorted, kind="stable")
        self.steps: NDArray[np.int64] = unsorted[self._order]

    def lists(self, name: str, kind: type[Any], *, optional: bool = False) -> list[list[Any]]:
        """A list of its own length for each row.

        Args:
            name: of the stream.
            kind: Python type of the values.
            optional: a batch without the stream counts as empty lists.

        Raises:
            SessionError: the stream is missing or of another type.
        """
        rows: list[list[Any]] = []
        for batch in self._batches:
            if optional and name not in batch.schema.names:
                rows += [[]] * batch.num_rows
            else:
                rows += self._column(batch, name, optional=optional).to_pylist()
        rows = [[] if row is None else row for row in rows]
        if not all(type(value) is kind for row in rows for value in row):
            raise SessionError(f"stream '{self._entity}/{name}': expected lists of {kind.__name__}")
        return [rows[row] for row in self._order]

    def texts(self, name: str) -> list[str]:
        """One text a row.

        Raises:
            SessionError: as `lists`.
        """
        rows = self.lists(name, str)
        if any(len(row) != 1 for row in rows):
            raise SessionError(f"stream '{self._entity}/{name}': expected one text a row")
        return [row[0] for row in rows]

    def block(self, name: str, kind: type[Number], width: int | None = None) -> NDArray[Number]:
        """As many numbers in each row, shape (rows, width).

        Args:
            name: of the stream.
            kind: NumPy type of the numbers.
            width: how many there must be; None takes the first row's.

        Raises:
            SessionError: the stream is missing, or has another type or width.
        """
        wanted = pa.from_numpy_dtype(np.dtype(kind))
        blocks = []
        for batch in self._batches:
            column = self._column(batch, name)
            lists = _unwrapped(column)
            lengths = pc.list_value_length(lists).to_numpy(zero_copy_only=False)
            if width is None and len(lengths):
                width = int(lengths[0])
            values = lists.flatten()
            even = len(lists) == len(column) and bool((lengths == width).all())
            if values.type != wanted or values.null_count or not even:
                raise SessionError(
                    f"stream '{self._entity}/{name}': expected {width} × {wanted} a row, found {column.type}"
                )
            blocks.append(values.to_numpy(zero_copy_only=False).reshape(len(column), -1))
        gathered = np.concatenate(blocks) if blocks else np.empty((0, width or 0), kind)
        return gathered[self._order].astype(kind, copy=False)

    def numbers(self, name: str, kind: type[Number]) -> NDArray[Number]:
        """One number a row, shape (rows,).

        Raises:
            SessionError: as `block`.
        """
        return self.block(name, kind, 1)[:, 0]

    def _column(self, batch: pa.RecordBatch, name: str, *, optional: bool = False) -> pa.Array:
        if name not in batch.schema.names:
            raise SessionError(f"stream '{self._entity}/{name}' is missing")
        column = batch.column(name)
        if not pa.types.is_list(column.type) or (column.null_count and not optional):
            raise SessionError(f"stream '{self._entity}/{name}': expected lists, found {column.type}")
        return column

    def _step_column(self, batch: pa.RecordBatch) -> NDArray[np.int64]:
        if STEP not in batch.schema.names or batch.schema.field(STEP).type != pa.int64():
            raise SessionError(f"entity '{self._entity}': expected a timeline '{STEP}'")
        steps: NDArray[np.int64] = batch.column(STEP).to_numpy(zero_copy_only=False)
        return steps


class SessionFile:
    """An .rrd of pdtui, read once from its beginning to its end.

    Args:
        path: the file.
        only: components of the drive to keep; all if empty.
        skip: components of the drive to leave out.

    Raises:
        SessionError: no such file, not a recording, another program's, or torn.
    """

    def __init__(self, path: Path, *, only: Sequence[str] = (), skip: Sequence[str] = ()) -> None:
        _check_magic(path)
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self._properties: dict[str, dict[str, list[Any]]] = {}
        with _reading(path):
            reader = RrdReader(path)
            stores = reader.recordings()
            if not stores:
                raise SessionError(f"{path}: holds no recording")
            if stores[0].application_id != APP:
                raise SessionError(
                    f"{path}: expected a recording of {APP}, found one of '{stores[0].application_id[:60]}'"
                )
            for chunk in reader.stream():
                self._take(chunk, only, skip)

    def properties(self, name: str) -> dict[str, list[Any]]:
        """Values of one group of properties, by name; empty if the file has none."""
        return self._properties.get(name, {})

    def rows(self, entity: str) -> Rows:
        """All rows of an entity; none if the file has none."""
        return Rows(entity, self._batches.get(entity, []))

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


def _unwrapped(column: pa.Array) -> pa.Array:
    """Lists of numbers, where the recorder wrote lists of one list each."""
    while pa.types.is_list(column.type.value_type):
        column = column.flatten()
    return column


def _check_magic(path: Path) -> None:
    try:
        with path.open("rb") as handle:
            magic = handle.read(len(_MAGIC))
    except FileNotFoundError:
        raise SessionError(f"{path}: no such file") from None
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error.strerror}") from error
    if magic != _MAGIC:
        raise SessionError(f"{path}: expected a Rerun recording (.rrd), found another kind of file")


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        with warnings.catch_warnings():
            # A session that was killed has no footer; that is no news to its reader.
            warnings.simplefilter("ignore")
            yield
    except (RuntimeError, ValueError, OSError, pa.ArrowException) as error:
        if "exceeds file size" in str(error) or "too small" in str(error):
            raise SessionError(
                f"{path}: the file is torn: its last message is cut; "
                "`rerun rrd optimize` can rescue what is before it"
            ) from error
        raise SessionError(f"{path}: cannot be read as a recording: {error}") from error
