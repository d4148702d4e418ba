"""Step 2, spectrum: the recorded series at the preset's scale, and their short-time Fourier transform."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from pdtui.core.attributes import Attribute, Floats
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import MatchingPreset

BLOCK = 128
"""Units per block: what is computed of them at one frequency fits into a core's own cache."""
LONGEST_PRODUCT = 256
"""Longest window, in samples, whose transform is a matrix product; an FFT is faster for longer ones."""
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
Complexes = NDArray[np.complex128]


def usable_episodes(episodes: Sequence[MonitoredEpisode], preset: MatchingPreset) -> list[MonitoredEpisode]:
    """Return the episodes that are at least one window long."""
    return [episode for episode in episodes if episode.steps >= preset.length]


def scaled_attribute_series(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], preset: MatchingPreset
) -> list[Floats]:
    """Return the scaled attributes of each episode, shape (T, J) each."""
    series = [np.array(episode.attributes, np.float64) for episode in episodes]
    if preset.angles == "wrapped":
        for column, attribute in enumerate(attributes):
            if attribute.wraps:
                for values in series:
                    values[:, column] = np.pi - (np.pi - values[:, column]) % (2 * np.pi)
    if preset.scaling == "standardized":
        return _standardized(series)
    if preset.scaling == "observed":
        for values in series:
            for column, attribute in enumerate(attributes):
                values[:, column] = attribute.as_observed(values[:, column])
    return series


def scaled_activation_series(
    episodes: Sequence[MonitoredEpisode], units: slice | NDArray[np.intp], preset: MatchingPreset
) -> list[NDArray[Any]]:
    """Return the scaled activations of B units of each episode, shape (T, B) each."""
    series = [episode.activations[:, units] for episode in episodes]
    return _standardized(series) if preset.scaling == "standardized" else series


def map_unit_blocks(
    work: Callable[[slice], _Result], units: int, block: int = BLOCK
) -> Iterator[tuple[slice, _Result]]:
    """Call a function with each block of units, on all cores; memory grows by one block per core.

    Each block, a slice of the units, comes with its result, in order. numpy and scipy release the
    interpreter's lock, so threads are enough.
    """
    blocks = [slice(low, min(low + block, units)) for low in range(0, units, block)]
    yield from zip(blocks, map_on_cores(work, blocks), strict=True)


def map_on_cores(work: Callable[[_Item], _Result], items: Sequence[_Item]) -> Iterator[_Result]:
    """Call a function with each item in threads, one for each core, and yield the results in order."""
    # More threads within the matrix products would only wait for these.
    with _libraries().limit(limits=1, user_api="blas"):
        yield from _threads().map(work, items)


@cache
def _threads() -> ThreadPoolExecutor:
    """Return threads that are kept: on a busy machine, to start them takes as long as a small match."""
    return ThreadPoolExecutor(os.cpu_count() or 1, "pdtui spectra")


os.register_at_fork(after_in_child=_threads.cache_clear)  # a copy of a process has none of its threads


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def _standardized(series: Sequence[NDArray[Any]]) -> list[Floats]:
    together = np.concatenate(series).astype(np.float64)
    mean, spread = together.mean(axis=0), together.std(axis=0)
    # The mean of equal numbers is not exactly that number; a constant series has to become all zeros.
    still = np.ptp(together, axis=0) == 0
    mean[still], spread[still] = together[0, still], 1.0
    return [(values - mean) / spread for values in series]


def short_time_transform(series: NDArray[Any], preset: MatchingPreset) -> Complexes:
    """Return the short-time Fourier transform of N series, shape (T, N).

    ``STFT(d, ω) = Σ_t w(t) x(d·hop + t) exp(−iωt) / Σ_t w(t)``, so phases count from each window's start.

    Returns:
        The transform in D whole windows and F bins, shape (N, D, F); D is 0 if T is shorter than a window.
    """
    import scipy.fft  # a drive needs it only once its spectra are looked at

    if len(series) < preset.length:
        return np.empty((series.shape[1], 0, preset.bins), np.complex128)
    # With one series after the other, the transform reads memory in order. It costs as much as scipy's
    # ShortTimeFFT, whose result would still have to be transposed to (N, D, F).
    samples = np.ascontiguousarray(series.T, np.float64)
    windows = sliding_window_view(samples, preset.length, axis=1)[:, :: preset.hop]
    return np.asarray(scipy.fft.rfft(windows * preset.weights, axis=-1, overwrite_x=True))


def spectrogram(spectra: Complexes, preset: MatchingPreset) -> Floats:
    """Return ``SG = |STFT|²`` (``power``, section 3.2) or ``|STFT|`` (``magnitude``), shape (N, D, F)."""
    power: Floats = np.square(spectra.real)
    power += np.square(spectra.imag)
    return power if preset.spectrogram == "power" else np.sqrt(power, out=power)


def window_view(series: NDArray[Any], preset: MatchingPreset) -> NDArray[Any]:
    """Return the windows of N series, shape (T, N), without a copy: shape (D, L, N)."""
    return sliding_window_view(series, preset.length, axis=0)[:: preset.hop].transpose(0, 2, 1)


@lru_cache(maxsize=8)
def transform_matrix(preset: MatchingPreset) -> Complexes:
    """Return the matrix, shape (F, L), whose product with a window of samples is its weighted transform."""
    import scipy.fft

    return np.asarray(scipy.fft.rfft(np.diag(preset.weights), axis=0), np.complex128)


def transform_at_bins(
    series: NDArray[Any], preset: MatchingPreset, bins: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """Return real and imaginary parts of N series, shape (T, N), at n bins, shape (D, n, N) each.

    They are those of `short_time_transform` to rounding, but only these bins are computed. The series are at
    least one window long.
    """
    if preset.length > LONGEST_PRODUCT:
        spectra = short_time_transform(series, preset)[:, :, bins].transpose(1, 2, 0)
        return np.ascontiguousarray(spectra.real), np.ascontiguousarray(spectra.imag)
    rows = transform_matrix(preset)[bins]
    both = np.concatenate([rows.real, rows.imag])
    parts: Floats = np.matmul(both, window_view(series.astype(np.float64), preset))
    return parts[:, : len(bins)], parts[:, len(bins) :]
