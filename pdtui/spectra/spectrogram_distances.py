"""Distances between the spectrograms of one episode, in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import short_time_transform, spectrogram

# ``|a|² + |b|² − 2ab`` loses digits where a and b are close. Below this share of ``|a|² + |b|²`` the
# difference itself is squared, so that relative errors stay under 1e-9.
_NEAR = 1e-6


class EpisodeSpectra:
    """Flattened spectrograms of the series of one episode, and their squared norms."""

    @np.errstate(invalid="ignore", over="ignore")
    def __init__(self, series: NDArray[Any], preset: MatchingPreset) -> None:
        whole = spectrogram(short_time_transform(series, preset), preset)
        # Copying the few level bins is cheaper than a second pass over all bins.
        self.level = whole[:, :, : preset.level_bins].reshape(len(whole), -1)
        counted = whole[:, :, preset.first_bin :]
        self.all = counted.reshape(len(whole), -1)
        self.levels_count = preset.first_bin == 0
        self.squares = np.einsum("nk,nk->n", self.all, self.all)
        self.level_squares = np.einsum("nk,nk->n", self.level, self.level)


@np.errstate(invalid="ignore", over="ignore")  # flaws report what is not finite
def compare_spectra(targets: EpisodeSpectra, units: EpisodeSpectra) -> tuple[Floats, Floats]:
    """Return distances and level shares of one episode, shape (J, B) each; shares are NaN without levels."""
    sums = targets.squares[:, None] + units.squares
    total = sums - 2.0 * (targets.all @ units.all.T)
    level = targets.level_squares[:, None] + units.level_squares - 2.0 * (targets.level @ units.level.T)
    for row, column in zip(*np.nonzero(total < _NEAR * sums), strict=True):
        total[row, column] = np.square(units.all[column] - targets.all[row]).sum()
        level[row, column] = np.square(units.level[column] - targets.level[row]).sum()
    return np.sqrt(total), level_share(level, total, counts=targets.levels_count)


def level_share(level: Floats, total: Floats, *, counts: bool) -> Floats:
    """Return the share of squared distances that is in the level bins; NaN if levels do not count."""
    if not counts:
        return np.full_like(total, np.nan)
    share = np.divide(level, total, out=np.zeros_like(total), where=total > 0)
    return np.clip(share, 0.0, 1.0)
