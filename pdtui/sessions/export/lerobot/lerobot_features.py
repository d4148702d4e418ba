"""The features of a LeRobot dataset that is made from a session, and their statistics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

_DTYPES = {"float32": np.float32, "int64": np.int64, "bool": np.bool_}


@dataclass(frozen=True)
class LerobotFeature:
    """A feature: its type, its length, and the names of its components.

    Attributes:
        dtype: ``float32``, ``int64`` or ``bool``.
        size: number of components.
        names: their names; None where they have none.
    """

    dtype: str
    size: int = 1
    names: tuple[str, ...] | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``info.json``."""
        names = None if self.names is None else list(self.names)
        return {"dtype": self.dtype, "shape": [self.size], "names": names}

    def to_arrow(self, values: NDArray[Any]) -> pa.Array:
        """Return values of shape (n,) or (n, size) as a column."""
        flat = pa.array(np.ascontiguousarray(values, _DTYPES[self.dtype]).reshape(-1))
        # The format has a plain column for one component, and lists of one length for several.
        return flat if self.size == 1 else pa.FixedSizeListArray.from_arrays(flat, self.size)


Statistics = dict[str, dict[str, list[Any]]]


def describe_rows(rows: Mapping[str, NDArray[Any]]) -> Statistics:
    """Return least and largest value, mean, standard deviation and number of each component."""
    found: Statistics = {}
    for name, values in rows.items():
        block = np.asarray(values, np.float64).reshape(len(values), -1)
        found[name] = {
            "min": block.min(axis=0).tolist(),
            "max": block.max(axis=0).tolist(),
            "mean": block.mean(axis=0).tolist(),
            "std": block.std(axis=0).tolist(),
            "count": [len(block)],
        }
    return found


def combine_statistics(parts: Sequence[Statistics]) -> Statistics:
    """Return the statistics of all rows from those of their parts (Chan, Golub and LeVeque 1983)."""
    combined: Statistics = {}
    for name in parts[0]:
        table = {key: np.array([part[name][key] for part in parts]) for key in parts[0][name]}
        counts = table["count"].astype(np.float64)
        total = counts.sum()
        mean = (table["mean"] * counts).sum(axis=0) / total
        spread = (counts * (table["std"] ** 2 + (table["mean"] - mean) ** 2)).sum(axis=0) / total
        combined[name] = {
            "min": table["min"].min(axis=0).tolist(),
            "max": table["max"].max(axis=0).tolist(),
            "mean": mean.tolist(),
            "std": np.sqrt(spread).tolist(),
            "count": [int(total)],
        }
    return combined
