"""Build Arrow columns for `rerun.send_columns` from NumPy arrays, without copies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from pdtui.sessions.session_schema import STEP, TIME


@dataclass(frozen=True)
class ComponentColumn:
    """A component column whose Arrow array is ready."""

    descriptor: rr.ComponentDescriptor
    array: Any

    def component_descriptor(self) -> rr.ComponentDescriptor:
        return self.descriptor

    def as_arrow_array(self) -> Any:
        return self.array


@dataclass(frozen=True)
class TimeColumn:
    """A time column whose Arrow array is ready."""

    name: str
    array: Any

    def timeline_name(self) -> str:
        return self.name

    def as_arrow_array(self) -> Any:
        return self.array


Descriptor = rr.ComponentDescriptor | str


def stack_rows(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Stack arrays of shape (width,) like `numpy.stack`, which takes twice as long for many short arrays."""
    return np.concatenate(arrays).reshape(len(arrays), -1)


def time_columns(steps: Sequence[int], dt: float) -> list[TimeColumn]:
    """Return both timelines: the control step, and the simulated time at which it starts."""
    numbers = np.array(steps, dtype=np.int64)
    nanoseconds = np.rint(numbers * (dt * 1e9)).astype("timedelta64[ns]")
    return [TimeColumn(STEP, pa.array(numbers)), TimeColumn(TIME, pa.array(nanoseconds))]


def number_list_column(descriptor: Descriptor, block: NDArray[Any]) -> ComponentColumn:
    """Return an array (n, width) as n lists, or an array (n,) as n lists of one number."""
    offsets = _even_offsets(len(block), block.size // len(block))
    return _list_column(descriptor, pa.array(block.reshape(-1)), offsets)


def nested_list_column(descriptor: Descriptor, block: NDArray[Any]) -> ComponentColumn:
    """Return an array (n, width) as n lists of one list each, from which the viewer can select a number."""
    inner = _even_offsets(len(block), block.shape[1])
    values = pa.ListArray.from_arrays(inner, pa.array(block.reshape(-1)))
    return _list_column(descriptor, values, _even_offsets(len(block), 1))


def vector_list_column(descriptor: Descriptor, block: NDArray[Any]) -> ComponentColumn:
    """Return an array (n, m, k) as n lists of m vectors of length k."""
    count, width, length = block.shape
    item = pa.field("item", pa.from_numpy_dtype(block.dtype), nullable=False)
    values = pa.FixedSizeListArray.from_arrays(pa.array(block.reshape(-1)), type=pa.list_(item, length))
    return _list_column(descriptor, values, _even_offsets(count, width))


def ragged_vector_column(
    descriptor: Descriptor, vectors: NDArray[Any], counts: Sequence[int]
) -> ComponentColumn:
    """Return an array (m, k) as one list of vectors of length k per row; the counts add up to m."""
    values = vector_list_column(descriptor, vectors[None]).array.values
    return _list_column(descriptor, values, pa.array([0, *accumulate(counts)], pa.int32()))


def polylines_column(descriptor: Descriptor, strips: Sequence[NDArray[Any]]) -> ComponentColumn:
    """Return arrays (m, k) of any lengths as one row of polylines through m points with k coordinates."""
    points = np.concatenate(strips) if strips else np.empty((0, 3), np.float32)
    column = ragged_vector_column(descriptor, points, [len(strip) for strip in strips])
    item = pa.field("item", column.array.type.value_type, nullable=False)
    values = pa.ListArray.from_arrays(column.array.offsets, column.array.values, type=pa.list_(item))
    return _list_column(descriptor, values, pa.array([0, len(strips)], pa.int32()))


def polyline_column(descriptor: Descriptor, block: NDArray[Any]) -> ComponentColumn:
    """Return an array (n, m, k) as n lists of one polyline through m points with k coordinates."""
    points = vector_list_column(descriptor, block).array
    item = pa.field("item", points.type.value_type, nullable=False)
    strips = pa.ListArray.from_arrays(points.offsets, points.values, type=pa.list_(item))
    return _list_column(descriptor, strips, _even_offsets(len(block), 1))


def ragged_list_column(
    descriptor: Descriptor, lists: Sequence[Sequence[Any]], kind: pa.DataType
) -> ComponentColumn:
    """Return one list per row; their lengths may differ."""
    flat = [value for row in lists for value in row]
    offsets = pa.array([0, *accumulate(map(len, lists))], pa.int32())
    return _list_column(descriptor, pa.array(flat, kind), offsets)


def text_column(descriptor: Descriptor, values: Iterable[str]) -> ComponentColumn:
    """Return one text per row."""
    array = pa.array(list(values), pa.utf8())
    return _list_column(descriptor, array, _even_offsets(len(array), 1))


@lru_cache(maxsize=32)
def _even_offsets(count: int, width: int) -> pa.Array:
    return pa.array(np.arange(count + 1, dtype=np.int32) * np.int32(width))


def _list_column(descriptor: Descriptor, values: Any, offsets: pa.Array) -> ComponentColumn:
    if isinstance(descriptor, str):
        descriptor = rr.ComponentDescriptor(descriptor)
    return ComponentColumn(descriptor, pa.ListArray.from_arrays(offsets, values))
