"""The rows of one entity as columns whose types and lengths have been checked."""

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
    """All rows of one entity, in the order of their control steps; wrong ones are a `SessionError`.

    Args:
        entity: path of the entity.
        batches: its rows, as the file has them; each row states its control step.

    Attributes:
        steps: the control step of each row, shape (rows,).
    """

    def __init__(self, entity: str, batches: Sequence[pa.RecordBatch]) -> None:
        self._entity, self._batches = entity, batches
        steps = [self._step_column(batch) for batch in batches]
        unsorted = np.concatenate(steps) if steps else np.empty(0, np.int64)
        # Tools that rewrite a recording may change the order of its chunks.
        self._order = np.argsort(unsorted, kind="stable")
        self.steps: NDArray[np.int64] = unsorted[self._order]

    def has_column(self, name: str) -> bool:
        """Return whether any of the rows may have values in this column."""
        return any(name in batch.schema.names for batch in self._batches)

    def read_lists(self, name: str, kind: type[Any], *, optional: bool = False) -> list[list[Any]]:
        """Return one list of values of this Python type per row; their lengths may differ.

        A batch without the column stands for empty lists if it is `optional`.
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

    def read_texts(self, name: str) -> list[str]:
        """Return one text per row."""
        rows = self.read_lists(name, str)
        if any(len(row) != 1 for row in rows):
            raise SessionError(f"stream '{self._entity}/{name}': expected one text per row")
        return [row[0] for row in rows]

    def read_matrix(self, name: str, kind: type[Number], width: int | None = None) -> NDArray[Number]:
        """Return equally many numbers per row, shape (rows, width); by default as many as in the first."""
        wanted = pa.from_numpy_dtype(np.dtype(kind))
        blocks = []
        for batch in self._batches:
            column = self._column(batch, name)
            lists = _flatten_nested_lists(column)
            lengths = pc.list_value_length(lists).to_numpy(zero_copy_only=False)
            if width is None and len(lengths):
                width = int(lengths[0])
            values = lists.flatten()
            even = len(lists) == len(column) and bool((lengths == width).all())
            if values.type != wanted or values.null_count or not even:
                expected = f"expected {width} × {wanted} per row"
                raise SessionError(f"stream '{self._entity}/{name}': {expected}, found {column.type}")
            blocks.append(values.to_numpy(zero_copy_only=False).reshape(len(column), width or 0))
        gathered = np.concatenate(blocks) if blocks else np.empty((0, width or 0), kind)
        return gathered[self._order].astype(kind, copy=False)

    def read_numbers(self, name: str, kind: type[Number]) -> NDArray[Number]:
        """Return one number per row, shape (rows,)."""
        return self.read_matrix(name, kind, 1)[:, 0]

    def read_ragged(self, name: str, kind: type[Number]) -> tuple[NDArray[np.int64], NDArray[Number]]:
        """Return how many numbers each row has, shape (rows,), and all numbers in one array.

        A batch without the column, or a row without a list, stands for empty lists.
        """
        wanted = pa.from_numpy_dtype(np.dtype(kind))
        lengths, values = [np.empty(0, np.int64)], [np.empty(0, kind)]
        for batch in self._batches:
            if name not in batch.schema.names:
                lengths.append(np.zeros(batch.num_rows, np.int64))
                continue
            column = self._column(batch, name, optional=True)
            numbers = column.flatten()
            if numbers.type != wanted or numbers.null_count:
                raise SessionError(
                    f"stream '{self._entity}/{name}': expected lists of {wanted}, found {column.type}"
                )
            counts = pc.fill_null(pc.list_value_length(column), 0)
            lengths.append(counts.to_numpy(zero_copy_only=False).astype(np.int64))
            values.append(numbers.to_numpy(zero_copy_only=False))
        counted, flat = np.concatenate(lengths), np.concatenate(values)
        if (self._order == np.arange(len(self._order))).all():
            return counted, flat
        pieces = np.split(flat, np.cumsum(counted)[:-1])
        return counted[self._order], np.concatenate([pieces[row] for row in self._order])

    def read_vectors(self, name: str, length: int, width: int) -> NDArray[np.float32]:
        """Return equally many vectors of this length per row, shape (rows, width, length)."""
        blocks = [np.empty((0, width, length), np.float32)]
        for batch in self._batches:
            column = self._column(batch, name)
            kind = column.type.value_type
            fits = pa.types.is_fixed_size_list(kind) and kind.list_size == length
            fits = fits and kind.value_type == pa.float32()
            fits = fits and bool((pc.list_value_length(column).to_numpy(zero_copy_only=False) == width).all())
            values = column.flatten().flatten() if fits else None
            if values is None or values.null_count or len(values) != len(column) * width * length:
                expected = f"expected {width} vectors of {length} float per row"
                raise SessionError(f"stream '{self._entity}/{name}': {expected}, found {column.type}")
            blocks.append(values.to_numpy(zero_copy_only=False).reshape(-1, width, length))
        return np.concatenate(blocks)[self._order]

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
            raise SessionError(f"entity '{self._entity}': expected every row to state its step")
        steps: NDArray[np.int64] = batch.column(STEP).to_numpy(zero_copy_only=False)
        return steps


def _flatten_nested_lists(column: pa.Array) -> pa.Array:
    """Remove the outer level of nested lists, which the recorder writes where the viewer selects a number."""
    while pa.types.is_list(column.type.value_type):
        column = column.flatten()
    return column
