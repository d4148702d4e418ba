"""Distances between spectrograms in single precision, with bounds on their errors.

Single precision is twice as fast, but a large or slowly changing level would take most of its digits.
Therefore the bins that a constant fills, a tenth of all, are computed in double precision, and the others
from the series minus their means, which change nothing in them. Spectrograms are used while they are in the
core's own cache, and never stored as a whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import transform_matrix, window_view
from pdtui.spectra.spectrogram_distances import level_share

Singles = NDArray[np.float32]

_WINDOWS = 8
"""Windows per product: their spectra of 256 units take 0.5 MB."""
_SINGLE = 4 * float(np.finfo(np.float32).eps)
_DOUBLE = 64 * float(np.finfo(np.float64).eps)
"""Bounds on the error of a squared distance, as shares of the squares that it is the difference of.

Errors of recorded episodes were at most a fifth of that. It is no proof, which would need 64 there, too.
"""
_SMALLEST = 1e-30
"""Squared distance below which single precision has no digits left."""


class BoundedDistances(NamedTuple):
    """Distances of one episode, shape (J, B) each.

    Attributes:
        distance: distance of each attribute and unit.
        share: share of the level, as in `compare_spectra`.
        bound: largest error of the distance.
    """

    distance: Floats
    share: Floats
    bound: Floats


class SinglePrecisionTargets:
    """The spectrograms of J attributes over one episode, with which units are compared.

    Args:
        series: the scaled attributes, shape (T, J), at least one window long.
        preset: the preset; its windows are at most `LONGEST_PRODUCT` samples long.
    """

    @np.errstate(invalid="ignore", over="ignore")
    def __init__(self, series: Floats, preset: MatchingPreset) -> None:
        self._preset = preset
        # One row per attribute, for one product with the same group of windows of the units.
        self._groups = [
            (moving.T.copy(), level.T.copy()) for moving, level in _iterate_spectra(series, preset)
        ]
        self._moving_squares = sum(np.square(moving).sum(axis=1) for moving, _ in self._groups)
        self._level_squares = sum(np.square(level).sum(axis=1) for _, level in self._groups)

    @np.errstate(invalid="ignore", over="ignore")  # flaws report what is not finite
    def compare(self, series: NDArray[Any]) -> BoundedDistances:
        """Compare with the series of B units over the same episode, shape (T, B)."""
        count = series.shape[1]
        moving_products = np.zeros((len(self._moving_squares), count))
        level_products = np.zeros_like(moving_products)
        moving_squares, level_squares = np.zeros(count), np.zeros(count)
        groups = zip(self._groups, _iterate_spectra(series, self._preset), strict=True)
        for (own_moving, own_level), (moving, level) in groups:
            moving_products += own_moving @ moving
            level_products += own_level @ level
            moving_squares += np.einsum("ku,ku->u", moving, moving)
            level_squares += np.einsum("ku,ku->u", level, level)
        moving_sums = self._moving_squares[:, None] + moving_squares
        level_sums = self._level_squares[:, None] + level_squares
        total = moving_sums - 2.0 * moving_products
        error = _SINGLE * moving_sums + _SMALLEST
        within = level_sums - 2.0 * level_products
        levels_count = self._preset.first_bin == 0
        if levels_count:
            total += within
            error += _DOUBLE * level_sums
        distance = np.sqrt(np.maximum(total, 0.0))
        bound = error / np.maximum(distance, np.sqrt(error))
        return BoundedDistances(distance, level_share(within, total, counts=levels_count), bound)


def _iterate_spectra(series: NDArray[Any], preset: MatchingPreset) -> Iterator[tuple[Singles, Floats]]:
    """Yield spectrograms of N series, shape (T, N), in groups of g windows, shape (g·F, N).

    The first of a pair are the bins above the level's, the second the level's. Both are valid until the next.
    """
    level_rows, moving_rows = _transform_rows(preset)
    centered = np.subtract(series, series.mean(axis=0).astype(series.dtype)).astype(np.float32, copy=False)
    moving = _Transform(moving_rows, window_view(centered, preset), preset)
    level = _Transform(level_rows, window_view(series.astype(np.float64), preset), preset)
    for first in range(0, len(moving.windows), _WINDOWS):
        yield moving.compute_spectrogram(first), level.compute_spectrogram(first)


class _Transform:
    """Computes spectrograms of groups of windows in one place in memory.

    Args:
        rows: matrices of the real parts and, behind them, of the imaginary parts, shape (2·F, L).
        windows: the windows of N series, shape (D, L, N).
        preset: the preset.
    """

    def __init__(self, rows: NDArray[Any], windows: NDArray[Any], preset: MatchingPreset) -> None:
        self.windows, self._rows = windows, rows
        self._is_power = preset.spectrogram == "power"
        count = windows.shape[2]
        self._parts = np.empty((_WINDOWS, len(rows), count), windows.dtype)
        self._result = np.empty((_WINDOWS, len(rows) // 2, count), windows.dtype)

    def compute_spectrogram(self, first: int) -> NDArray[Any]:
        """Return the spectrogram of a group that begins with this window, shape (g·F, N)."""
        windows = self.windows[first : first + _WINDOWS]
        parts = np.matmul(self._rows, windows, out=self._parts[: len(windows)])
        np.square(parts, out=parts)
        half = parts.shape[1] // 2
        result = np.add(parts[:, :half], parts[:, half:], out=self._result[: len(windows)])
        if not self._is_power:
            np.sqrt(result, out=result)
        return result.reshape(-1, result.shape[2])


@lru_cache(maxsize=8)
def _transform_rows(preset: MatchingPreset) -> tuple[Floats, Singles]:
    """Return the matrices of the level's bins, and of those above it in single precision."""
    matrix = transform_matrix(preset)
    level, moving = matrix[: preset.level_bins], matrix[preset.level_bins :]
    return (
        np.concatenate([level.real, level.imag]),
        np.concatenate([moving.real, moving.imag]).astype(np.float32),
    )
