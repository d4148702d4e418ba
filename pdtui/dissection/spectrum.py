"""Step 2, spectrum: the short-time Fourier transform of every series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from pdtui.errors import PdtuiError
from pdtui.robots.types import Floats

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Preset:
    """Every choice that the spectrum leaves open.

    Windows are the periodic variant and lie wholly inside the series: window d starts at sample ``d·hop``
    and nothing is padded. The transform is divided by the window's sum, so that a constant c has |STFT| = c
    in the bin of frequency 0; every distance then scales alike and no rank changes.

    Attributes:
        name: how the command line calls it.
        window: shape of the window.
        length: of the window, samples.
        hop: between windows, samples.
        power: 2 for the spectrogram |STFT|², 1 for the magnitude |STFT|.
        level_bins: how many bins, from frequency 0 up, a constant fills with this window: a Blackman window
            has three cosine terms, a Hann window two. Matching reports how much of a distance lies in them.
        phase_from_bin: lowest bin that may be the predominant frequency. The paper's argmax is over all, so
            0: for an attribute that is mostly mean level the "phase" is then the sign of the unit's mean.
    """

    name: str
    window: Literal["blackman", "hann"]
    length: int
    hop: int
    power: Literal[1, 2]
    level_bins: int
    phase_from_bin: int = 0

    @property
    def weights(self) -> Floats:
        """The window divided by its sum, shape (length,)."""
        angle = 2 * np.pi * np.arange(self.length) / self.length
        window: Floats
        if self.window == "blackman":
            window = 0.42 - 0.5 * np.cos(angle) + 0.08 * np.cos(2 * angle)
        else:
            window = 0.5 - 0.5 * np.cos(angle)
        window /= window.sum()
        return window

    @property
    def bins(self) -> int:
        """Number of frequencies, from 0 to half the sampling rate."""
        return self.length // 2 + 1

    def frequencies(self, dt: float) -> Floats:
        """Frequency of each bin in Hz, shape (F,), for samples `dt` seconds apart."""
        frequencies: Floats = np.asarray(np.fft.rfftfreq(self.length, dt), np.float64)
        return frequencies


# Section 3.2 and appendix of the paper, and what its authors' released code computes.
PRESETS: dict[str, Preset] = {
    preset.name: preset
    for preset in (
        Preset("paper", "blackman", 64, 16, 2, level_bins=3),
        Preset("authors", "hann", 32, 8, 1, level_bins=2),
    )
}


def find_preset(name: str) -> Preset:
    """A preset by its name.

    Raises:
        PdtuiError: there is none of that name.
    """
    if name not in PRESETS:
        raise PdtuiError(f"unknown preset '{name}'; there are {', '.join(PRESETS)}")
    return PRESETS[name]


def transform(series: NDArray[Any], preset: Preset) -> Complexes:
    """Short-time Fourier transform of many series at once.

    ``STFT(d, ω) = Σ_t w(t) x(d·hop + t) exp(−iωt) / Σ_t w(t)``, so phases count from each window's start.

    Args:
        series: shape (T, N).
        preset: window, length and hop.

    Returns:
        shape (N, D, F): D whole windows, none where T is shorter than a window.
    """
    samples = np.asarray(series, np.float64)
    if len(samples) < preset.length:
        return np.empty((samples.shape[1], 0, preset.bins), np.complex128)
    windows = sliding_window_view(samples, preset.length, axis=0)[:: preset.hop]
    spectra: Complexes = np.fft.rfft(windows * preset.weights, axis=-1)
    return spectra.transpose(1, 0, 2)


def spectrogram(spectra: Complexes, preset: Preset) -> Floats:
    """``SG = |STFT|²`` (preset ``paper``, section 3.2) or ``|STFT|`` (``authors``), shape (N, D, F)."""
    magnitude = np.abs(spectra)
    result: Floats = magnitude if preset.power == 1 else magnitude**2
    return result
