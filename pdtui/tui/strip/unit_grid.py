"""Where the strip of hidden units draws each layer, and each unit of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_PIXELS = 2
"""Rows of pixels of a line."""


def allocate_layer_rows(layers: Sequence[int], rows: int, first: int = 0) -> list[tuple[int, int]]:
    """Return the first pixel row and the number of pixel rows of each layer; those without room get none.

    Where there are enough lines, each layer gets whole lines; rows that are left go to the layers with most
    units per row.

    Args:
        layers: widths of the layers.
        rows: pixel rows, two per line.
        first: the first layer that is shown.
    """
    shown = list(range(first, min(len(layers), first + rows)))
    quantum = _PIXELS if len(shown) * _PIXELS <= rows else 1
    given = dict.fromkeys(shown, quantum)
    for _ in range((rows - quantum * len(shown)) // quantum if shown else 0):
        given[max(shown, key=lambda layer: layers[layer] / given[layer])] += quantum
    places, top = [], 0
    for layer in range(len(layers)):
        places.append((top, given.get(layer, 0)))
        top += given.get(layer, 0)
    return places


def last_first_layer(layers: Sequence[int], rows: int) -> int:
    """Return the layer up to which the strip can be scrolled: from it on, all layers have room."""
    return max(0, len(layers) - rows)


@dataclass(frozen=True)
class UnitGrid:
    """The places of a layer's units, which run down, then right, on `rows` × `columns` pixels.

    Fewer units than pixels are drawn wider, so that a layer always fills its rows; if there are more units
    than pixels, neighbors share one.
    """

    units: int
    rows: int
    columns: int

    @property
    def steps(self) -> int:
        """Number of different columns."""
        return min(self.columns, -(-self.units // self.rows))

    def group_of(self, index: int) -> int:
        """Return the number of the pixel, of those that differ, that shows a unit."""
        groups = self.rows * self.steps
        return index * groups // self.units if self.units > groups else index

    def column_of(self, index: int) -> int:
        """Return the leftmost column that shows a unit."""
        return -(-(self.group_of(index) // self.rows) * self.columns // self.steps)

    def row_of(self, index: int) -> int:
        """Return the row that shows a unit."""
        return self.group_of(index) % self.rows

    def units_at(self, row: int, column: int) -> range:
        """Return the units that a pixel shows; none where there is no unit."""
        groups = self.rows * self.steps
        group = column * self.steps // self.columns * self.rows + row
        if self.units <= groups:
            return range(group, min(group + 1, self.units))
        return range(-(-group * self.units // groups), -(-(group + 1) * self.units // groups))

    def spread(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the values as pixels, shape (rows, columns): the strongest of several, NaN for none."""
        groups = self.rows * self.steps
        if self.units > groups:
            group = np.arange(self.units) * groups // self.units
            starts = np.searchsorted(group, np.arange(groups))
            high, low = np.maximum.reduceat(values, starts), np.minimum.reduceat(values, starts)
            shown = np.where(high >= -low, high, low)
        else:
            shown = np.full(groups, np.nan, np.float32)
            shown[: self.units] = values
        pixels: NDArray[np.float32] = shown.reshape(self.steps, self.rows).T
        return pixels[:, np.arange(self.columns) * self.steps // self.columns]
