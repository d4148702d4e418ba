"""Chunks of one entity, gathered into columns whose types and lengths are known to be right."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from pdtui.core.errors import SessionError
from pdtui.sessions.session_schema import STEP

Number = TypeVar("Number", bound=np.generic)


class EntityTable:
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
            blocks.append(values.to_numpy(zero_copy_only=False).reshape(len(column), width or 0))
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
        if batch.column(STEP).null_count:
            raise SessionError(f"entity '{self._entity}': expected rows that say their step")
        steps: NDArray[np.int64] = batch.column(STEP).to_numpy(zero_copy_only=False)
        return steps


def _unwrapped(column: pa.Array) -> pa.Array:
    """Lists of numbers, where the recorder wrote lists of one list each."""
    while pa.types.is_list(column.type.value_type):
        column = column.flatten()
    return column
