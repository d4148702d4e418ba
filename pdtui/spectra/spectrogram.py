"""Step 2, spectrum: the short-time Fourier transform of each series."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.spectra.matching_presets import MatchingPreset

Complexes = NDArray[np.complex128]


def short_time_transform(series: NDArray[Any], preset: MatchingPreset) -> Complexes:
    """Return the short-time Fourier transform of N series.

    ``STFT(d, ω) = Σ_t w(t) x(d·hop + t) exp(−iωt) / Σ_t w(t)``, so phases count from each window's start.

    Args:
        series: shape (T, N).
        preset: sets window, length and hop.

    Returns:
        The transform in D whole windows and F bins, shape (N, D, F); D is 0 if T is shorter than a window.
    """
    if len(series) < preset.length:
        return np.empty((series.shape[1], 0, preset.bins), np.complex128)
    # With one series after the other, the transform reads memory in order. It costs as much as scipy's
    # ShortTimeFFT, whose result would still have to be transposed to (N, D, F).
    samples = np.ascontiguousarray(series.T, np.float64)
    windows = sliding_window_view(samples, preset.length, axis=1)[:, :: preset.hop]
    spectra: Complexes = scipy.fft.rfft(windows * preset.weights, axis=-1, overwrite_x=True)
    return spectra


def spectrogram(spectra: Complexes, preset: MatchingPreset) -> Floats:
    """Return ``SG = |STFT|²`` (``power``, section 3.2) or ``|STFT|`` (``magnitude``), shape (N, D, F)."""
    power: Floats = np.square(spectra.real)
    power += np.square(spectra.imag)
    return power if preset.spectrogram == "power" else np.sqrt(power, out=power)
