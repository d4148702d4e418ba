"""Distances of all units from all attributes, and their means over episodes."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.near_ties import find_near_ties
from pdtui.spectra.single_precision import BoundedDistances, SinglePrecisionTargets
from pdtui.spectra.spectrogram import map_on_cores, map_unit_blocks, scaled_activation_series
from pdtui.spectra.spectrogram_distances import EpisodeSpectra, compare_spectra

_LARGEST_BLOCK, _SMALLEST_BLOCK, _EXACT_BLOCK = 256, 64, 16
_RANKS = 512
"""Number of nearest units of each attribute whose order does not depend on single precision."""


def measure_in_double_precision(
    episodes: Sequence[MonitoredEpisode],
    targets: Sequence[Floats],
    units: NDArray[np.intp],
    preset: MatchingPreset,
    block: int = 0,
) -> tuple[Floats, Floats]:
    """Return distances and level shares of some units in double precision, shape (J, n) each.

    Args:
        episodes: the episodes.
        targets: the scaled attributes of each episode.
        units: flat indices of the n units.
        preset: the preset.
        block: number of units that are computed together; 0 for one that suits the cores.
    """
    spectra = list(map_on_cores(lambda series: EpisodeSpectra(series, preset), targets))

    def compare(part: slice) -> Floats:
        chosen = scaled_activation_series(episodes, units[part], preset)
        pairs = zip(spectra, chosen, strict=True)
        return _mean([compare_spectra(one, EpisodeSpectra(two, preset)) for one, two in pairs])

    found = [result for _, result in map_unit_blocks(compare, len(units), block or _EXACT_BLOCK)]
    distance, share = np.concatenate(found, axis=2)
    return distance, share


def measure_in_single_precision(
    episodes: Sequence[MonitoredEpisode], targets: Sequence[Floats], preset: MatchingPreset, block: int = 0
) -> BoundedDistances:
    """Return distances of all units in single precision, with the arguments of the double one."""
    units = episodes[0].activations.shape[1]
    spectra = list(map_on_cores(lambda series: SinglePrecisionTargets(series, preset), targets))

    def compare(part: slice) -> Floats:
        pairs = zip(spectra, scaled_activation_series(episodes, part, preset), strict=True)
        return _mean([one.compare(two) for one, two in pairs])

    found = [result for _, result in map_unit_blocks(compare, units, block or _choose_block(units))]
    return BoundedDistances(*np.concatenate(found, axis=2))


def settle_near_ties(
    found: BoundedDistances,
    episodes: Sequence[MonitoredEpisode],
    targets: Sequence[Floats],
    preset: MatchingPreset,
    *,
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    silent: Sequence[int],
) -> None:
    """Measure units exactly whose order single precision leaves open, and replace their distances.

    Args:
        found: the distances, which are changed.
        episodes, targets, preset: as in `measure_in_double_precision`.
        rows: the attributes that count.
        columns: the units that count.
        silent: units that never fire; all have the same distances, so that one of them is enough.
    """
    counted = np.ix_(rows, columns)
    tied = columns[find_near_ties(found.distance[counted], found.bound[counted], _RANKS)]
    again = np.setdiff1d(tied, silent[1:])
    if not len(again):
        return
    found.distance[:, again], found.share[:, again] = measure_in_double_precision(
        episodes, targets, again, preset
    )
    if silent and silent[0] in again:
        found.distance[:, silent] = found.distance[:, [silent[0]]]
        found.share[:, silent] = found.share[:, [silent[0]]]


def _mean(episodes: Sequence[tuple[Floats, ...]]) -> Floats:
    """Return the means of several arrays over episodes, in one array with one more axis."""
    return np.asarray(np.mean(episodes, axis=0), np.float64)


def _choose_block(units: int) -> int:
    """Return a number of units per block that gives each core one, and fits into its cache."""
    fair = -(-units // (os.cpu_count() or 1))
    return min(_LARGEST_BLOCK, max(_SMALLEST_BLOCK, fair))
