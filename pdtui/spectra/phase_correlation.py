"""Step 4, sign: correlation ρ of unit and attribute from their phases at the predominant frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
    usable_episodes,
)

DISAGREE = 0.1
"""Difference between the plain and the circular ρ above which both are reported."""
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
        targets = [
            short_time_transform(one, preset) for one in scaled_attribute_series(used, attributes, preset)
        ]
        energy = np.sum([spectrogram(target, preset).sum(axis=1) for target in targets], axis=0)
    allowed = np.nan_to_num(energy[:, preset.phase_from_bin :], nan=-1.0)
    bins = np.argmax(allowed, axis=1) + preset.phase_from_bin
    waves = np.concatenate([target[np.arange(len(bins)), :, bins] for target in targets], axis=1)

    def compare(units: slice) -> tuple[Floats, Floats]:
        spectra = [
            short_time_transform(one, preset)[:, :, bins]
            for one in scaled_activation_series(used, units, preset)
        ]
        return _correlate(np.concatenate(spectra, axis=1), waves)

    units = used[0].activations.shape[1]
    plain, circular = np.empty((len(attributes), units)), np.empty((len(attributes), units))
    for part, (plain_part, circular_part) in map_unit_blocks(compare, units, block):
        plain[:, part], circular[:, part] = plain_part, circular_part
    return PhaseCorrelations(bins, plain, circular)


@np.errstate(invalid="ignore", over="ignore")
def _correlate(units: Complexes, waves: Complexes) -> tuple[Floats, Floats]:
    """Return both ρ, shape (J, B) each, of units, shape (B, D, J), and attributes, shape (J, D)."""
    plain = np.full((len(waves), len(units)), np.nan)
    circular = plain.copy()
    for row, wave in enumerate(waves):
        product = units[:, :, row] * np.conj(wave)
        size = np.abs(product)
        heard = (size > _SILENT) & np.isfinite(size)
        difference = np.angle(product)
        # np.angle returns −π for a negative real with imaginary part −0, but phases are in (−π, π].
        difference[difference == -np.pi] = np.pi
        # The sum of unit phasors, without the sine and cosine of the angles.
        phasor = np.divide(product, size, out=np.zeros_like(product), where=heard).sum(axis=1)
        count = heard.sum(axis=1)
        known = count > 0
        mean = np.where(heard, difference, 0.0).sum(axis=1)[known] / count[known]
        plain[row, known] = phase_correlation(mean)
        circular[row, known] = phase_correlation(np.angle(phasor[known]))
    return plain, circular
