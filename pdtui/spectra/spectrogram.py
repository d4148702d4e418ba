"""Step 2, spectrum: the short-time Fourier transform of every series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import get_window

from pdtui.core.attributes import Floats

Complexes = NDArray[np.complex128]
Window = Literal["blackman", "hann", "hamming", "rectangular"]

# A window is a sum of so many cosines, and a constant fills as many bins from frequency 0 up.
_COSINE_TERMS: dict[Window, int] = {"blackman": 3, "hann": 2, "hamming": 2, "rectangular": 1}


@dataclass(frozen=True)
class MatchingPreset:
    """Every choice that the method leaves open; `pdtui.spectra.matching_presets` lists what each may be.

    Windows are the periodic variant and lie wholly inside the series: window d starts at sample ``d·hop``
    and nothing is padded. The transform is divided by the window's sum, so that a constant c has |STFT| = c
    in the bin of frequency 0; every distance then scales alike and no rank changes.

    Attributes:
        name: how the command line calls it.
        window: shape of the window.
        length: of the window, samples.
        hop: between windows, samples.
        spectrogram: ``power`` |STFT|² (section 3.2), or ``magnitude`` |STFT| (the authors' released code).
        scaling: of the series before the transform: ``observed``, attributes as the policy observes them;
            ``raw``, in their physical units; ``standardised``, attributes and units less their mean, in parts
            of their standard deviation over all episodes.
        level: ``kept``, or ``removed``: a distance then leaves out the bins that a constant fills.
        angles: ``unwrapped`` over time, or ``wrapped`` to (−π, π].
        predominant: frequency at which phases are compared: the strongest of ``any``, as in the paper (for an
            attribute that is mostly mean level it is 0, and the "phase" the sign of the unit's mean), or the
            strongest ``moving`` one, above the bins that a constant fills.
        phase_mean: which ρ the conclusions go by. Both are reported; ``plain`` is the paper's, but means
            nothing for phases near ±π.
        changed: what differs from the preset of this name, as ``NAME=VALUE``.
    """

    name: str
    window: Window
    length: int
    hop: int
    spectrogram: Literal["power", "magnitude"]
    scaling: Literal["observed", "raw", "standardised"] = "observed"
    level: Literal["kept", "removed"] = "kept"
    angles: Literal["unwrapped", "wrapped"] = "unwrapped"
    predominant: Literal["any", "moving"] = "any"
    phase_mean: Literal["circular", "plain"] = "circular"
    changed: tuple[str, ...] = ()

    def __str__(self) -> str:
        return " ".join((self.name, *self.changed))

    @property
    def weights(self) -> Floats:
        """The window divided by its sum, shape (length,)."""
        window: Floats = get_window(self.window, self.length)
        window /= window.sum()
        return window

    @property
    def bins(self) -> int:
        """Number of frequencies, from 0 to half the sampling rate."""
        return self.length // 2 + 1

    @property
    def level_bins(self) -> int:
        """How many bins, from frequency 0 up, a constant fills with this window."""
        return _COSINE_TERMS[self.window]

    @property
    def first_bin(self) -> int:
        """Lowest bin that a distance counts."""
        return self.level_bins if self.level == "removed" else 0

    @property
    def phase_from_bin(self) -> int:
        """Lowest bin that may be the predominant frequency."""
        return self.level_bins if self.predominant == "moving" or self.level == "removed" else 0

    def frequencies(self, dt: float) -> Floats:
        """Frequency of each bin in Hz, shape (F,), for samples `dt` seconds apart."""
        frequencies: Floats = np.asarray(np.fft.rfftfreq(self.length, dt), np.float64)
        return frequencies


def short_time_transform(series: NDArray[Any], preset: MatchingPreset) -> Complexes:
    """Short-time Fourier transform of many series at once.

    ``STFT(d, ω) = Σ_t w(t) x(d·hop + t) exp(−iωt) / Σ_t w(t)``, so phases count from each window's start.

    Args:
        series: shape (T, N).
        preset: window, length and hop.

    Returns:
        shape (N, D, F): D whole windows, none where T is shorter than a window.
    """
    if len(series) < preset.length:
        return np.empty((series.shape[1], 0, preset.bins), np.complex128)
    # One series after the other: the transform then reads memory in order.
    samples = np.ascontiguousarray(series.T, np.float64)
    windows = sliding_window_view(samples, preset.length, axis=1)[:, :: preset.hop]
    spectra: Complexes = scipy.fft.rfft(windows * preset.weights, axis=-1, overwrite_x=True)
    return spectra


def spectrogram(spectra: Complexes, preset: MatchingPreset) -> Floats:
    """``SG = |STFT|²`` (``power``, section 3.2) or ``|STFT|`` (``magnitude``), shape (N, D, F)."""
    power: Floats = np.square(spectra.real)
    power += np.square(spectra.imag)
    return power if preset.spectrogram == "power" else np.sqrt(power, out=power)
