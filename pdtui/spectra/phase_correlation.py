"""Step 4, sign: correlation ρ of unit and attribute from their phases at the predominant frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import (
    BLOCK,
    Complexes,
    map_unit_blocks,
    scaled_activation_series,
    scaled_attribute_series,
    short_time_transform,
    spectrogram,
    transform_at_bins,
    usable_episodes,
)

DISAGREE = 0.1
"""Difference between the plain and the circular ρ above which both are reported."""
_WRAP = 0.5 + 1e-10
"""Largest phase difference, turns: −π and π are the same phase, and rounding must not choose between them."""
_CANCELED = 1e-9
"""Length of a mean phasor at or below which rounding alone would choose its angle."""
_SILENT = 1e-12
"""Product of two amplitudes at or below which there is no phase: far below any signal, above rounding."""


@dataclass(frozen=True)
class PhaseCorrelations:
    """Correlations ρ of J attributes with U units.

    Both are NaN for a unit or attribute that has no amplitude, and so no phase, at the predominant frequency.

    Attributes:
        bins: predominant bin of each attribute, shape (J,).
        plain: ρ from the plain mean of the wrapped phase differences, as in the paper, shape (J, U). Phases
            near ±π alternate between the two ends, which makes their plain mean meaningless.
        circular: ρ from the circular mean (the angle of the mean phasor), shape (J, U).
    """

    bins: NDArray[np.intp]
    plain: Floats
    circular: Floats

    def rho(self, preset: MatchingPreset) -> Floats:
        """Return the ρ that the preset selects, shape (J, U)."""
        return self.plain if preset.phase_mean == "plain" else self.circular

    @property
    def disagree(self) -> NDArray[np.bool_]:
        """Pairs whose two correlations differ by more than `DISAGREE`, shape (J, U)."""
        return np.abs(self.plain - self.circular) > DISAGREE


def phase_correlation(phase: Floats) -> Floats:
    """Return ``ρ = 1 − |2p| / π`` (section 3.2): 1 in phase, −1 in antiphase, 0 in quadrature; p in rad."""
    return 1.0 - np.abs(2.0 * phase) / np.pi


def correlate_phases(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    *,
    block: int = BLOCK,
) -> PhaseCorrelations:
    """Compute with which sign and how closely units follow attributes.

    The predominant frequency ``ω* = argmax_ω Σ_d SG(d, ω | s)`` sums over the windows of all episodes. The
    phase difference at ω* is wrapped to (−π, π] and averaged over all windows of all episodes.
    At least one episode has to be one window long, which `match_units` checks.
    """
    used = usable_episodes(episodes, preset)
    with np.errstate(invalid="ignore", over="ignore"):  # match_units reports what is not finite
        targets = scaled_attribute_series(used, attributes, preset)
        spectra = [short_time_transform(target, preset) for target in targets]
        energy = np.sum([spectrogram(one, preset).sum(axis=1) for one in spectra], axis=0)
    allowed = np.nan_to_num(energy[:, preset.phase_from_bin :], nan=-1.0)
    bins = np.argmax(allowed, axis=1) + preset.phase_from_bin
    distinct, places = np.unique(bins, return_inverse=True)

    def transform(series: Sequence[NDArray[Any]]) -> tuple[Floats, Floats]:
        parts = [transform_at_bins(one, preset, distinct) for one in series]
        return np.concatenate([real for real, _ in parts]), np.concatenate([imag for _, imag in parts])

    def compare(units: slice) -> tuple[Floats, Floats]:
        return _correlate(transform(scaled_activation_series(used, units, preset)), waves, places)

    with np.errstate(invalid="ignore", over="ignore"):
        own = np.arange(len(bins))
        waves = [part[:, places, own] for part in transform(targets)]
    units = used[0].activations.shape[1]
    plain, circular = np.empty((len(attributes), units)), np.empty((len(attributes), units))
    for part, (plain_part, circular_part) in map_unit_blocks(compare, units, block):
        plain[:, part], circular[:, part] = plain_part, circular_part
    return PhaseCorrelations(bins, plain, circular)


@np.errstate(invalid="ignore", over="ignore", divide="ignore")
def _correlate(
    units: tuple[Floats, Floats], waves: Sequence[Floats], places: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """Return both ρ of J attributes and B units, shape (J, B) each.

    Units and attributes are real and imaginary parts, shape (D, n, B) and (D, J); `places` says at which of
    the n bins each attribute is compared.
    """
    count, _, width = units[0].shape
    plain, circular = np.empty((len(places), width)), np.empty((len(places), width))
    for place in np.unique(places):
        rows = np.flatnonzero(places == place)
        real, imag = (np.ascontiguousarray(part[:, place]) for part in units)
        size = np.square(real)
        size += np.square(imag)
        np.sqrt(size, out=size)
        turned = np.arctan2(imag, real)
        turned /= 2 * np.pi
        wave = waves[0][:, rows] + 1j * waves[1][:, rows]
        loudness, own = np.abs(wave), np.angle(wave) / (2 * np.pi)
        # The sum of unit phasors, without the sine and cosine of the angles. Real and imaginary parts that
        # lie apart are several times as fast as complex numbers.
        conjugate = (wave / loudness).conj().T
        both = np.concatenate([conjugate.real, conjugate.imag])
        by_real, by_imag = both @ (real / size), both @ (imag / size)
        half = len(rows)
        phasor = by_real[:half] - by_imag[half:] + 1j * (by_imag[:half] + by_real[half:])
        circular[rows] = _correlate_phasors(phasor, count)
        # The mean of wrapped differences is that of the differences less the whole turns in them.
        differences, turned_sum = np.empty_like(turned), turned.sum(axis=0)
        for row, turns in zip(rows, own.T, strict=True):
            np.subtract(turned, (turns + _WRAP)[:, None], out=differences)
            whole = np.ceil(differences, out=differences).sum(axis=0)
            plain[row] = phase_correlation(2 * np.pi * (turned_sum - turns.sum() - whole) / count)
        least, most = size.min(axis=0), size.max(axis=0)
        for row, wave_of_row, sizes in zip(rows, wave.T, loudness.T, strict=True):
            silent = ~((least * sizes.min() > _SILENT) & np.isfinite(most * sizes.max()))
            if silent.any():
                product = (real[:, silent] + 1j * imag[:, silent]) * wave_of_row.conj()[:, None]
                plain[row, silent], circular[row, silent] = _correlate_heard(product)
    return plain, circular


def _correlate_heard(product: Complexes) -> tuple[Floats, Floats]:
    """Return both ρ of B units from products with the conjugate of an attribute's wave, shape (D, B).

    Windows in which either has no amplitude do not count.
    """
    size = np.abs(product)
    heard = (size > _SILENT) & np.isfinite(size)
    difference = np.where(heard, np.angle(product), 0.0)
    difference[difference <= 2 * np.pi * (_WRAP - 1.0)] += 2 * np.pi
    phasor = np.divide(product, size, out=np.zeros_like(product), where=heard).sum(axis=0)
    count = heard.sum(axis=0)
    plain = phase_correlation(difference.sum(axis=0) / np.maximum(count, 1))
    circular = _correlate_phasors(phasor, count)
    return np.where(count, plain, np.nan), np.where(count, circular, np.nan)


def _correlate_phasors(total: Complexes, count: int | NDArray[np.intp]) -> Floats:
    """Return ρ from the sum of the unit phasors of so many windows; 1 where they cancel each other."""
    return phase_correlation(np.angle(np.where(np.abs(total) > _CANCELED * count, total, 0.0)))
