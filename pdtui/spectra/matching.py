"""Step 3, match: the distance between the spectrograms of units and attributes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PolicyError
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.mean_distances import (
    measure_in_double_precision,
    measure_in_single_precision,
    settle_near_ties,
)
from pdtui.spectra.series_flaws import find_attribute_flaws, find_unit_flaws, is_left_out, is_silent
from pdtui.spectra.spectrogram import (
    LONGEST_PRODUCT,
    scaled_activation_series,
    scaled_attribute_series,
    usable_episodes,
)
from pdtui.spectra.spectrogram_distances import EpisodeSpectra, compare_spectra


@dataclass(frozen=True)
class UnitDiscrepancies:
    """Discrepancies of J attributes and U units.

    Attributes:
        discrepancy: mean over the episodes used, shape (J, U); NaN if the attribute or the unit is left out.
        level_share: share of the squared distance in the bins that a constant fills, in [0, 1], mean over the
            episodes, shape (J, U). Near 1, mean levels (and anything slower than those bins) are compared
            rather than movement.
        used: seeds of the episodes used.
        skipped: (seed, steps) of the episodes that are shorter than one window.
        flaws: what is wrong with attributes, by name: not finite (left out), or constant (kept, although only
            its level can match, unless the preset removes levels).
        unit_flaws: the same for units, by flat index; a unit that never fires is constant.
    """

    discrepancy: Floats
    level_share: Floats
    used: tuple[int, ...]
    skipped: tuple[tuple[int, int], ...]
    flaws: dict[str, str]
    unit_flaws: dict[int, str] = field(default_factory=dict)

    def ranked_units(self, column: int) -> NDArray[np.intp]:
        """Return the units by discrepancy with one attribute, nearest first; none if it is left out."""
        row = self.discrepancy[column]
        return np.argsort(row, kind="stable")[: int(np.isfinite(row).sum())]


def match_units(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    *,
    block: int = 0,
) -> UnitDiscrepancies:
    """Compute ``Dis(z, s) = ‖SG_z − SG_s‖₂`` of all units z and attributes s (section 3.2).

    The norm is over all frequencies and windows, and its mean is taken over the episodes. Time grows linearly
    with units, attributes and episodes; memory grows by one block of units per core.

    Distances are computed in single precision, with a bound on the error of each. Those that are too close to
    others for that are computed again in double precision, so that the order of the nearest 512 units of each
    attribute is that of double precision. Relative errors of the others are below 1e-4, and usually 1e-6.
    Windows of more than 256 samples are computed in double precision throughout.

    Args:
        episodes: the episodes.
        attributes: the attributes, one for each column.
        preset: the choices that the method leaves open.
        block: number of units that are computed together; 0 for one that suits the cores.

    Raises:
        PolicyError: no episode is as long as one window.
    """
    used = usable_episodes(episodes, preset)
    skipped = tuple((episode.seed, episode.steps) for episode in episodes if episode.steps < preset.length)
    if not used:
        lengths = ", ".join(str(steps) for _, steps in skipped) or "none"
        raise PolicyError(
            f"expected an episode of at least {preset.length} steps (one window of preset '{preset}'), "
            f"got {lengths}"
        )
    targets = scaled_attribute_series(used, attributes, preset)
    units = used[0].activations.shape[1]
    flaws = find_attribute_flaws(used, attributes, preset)
    unit_flaws = find_unit_flaws(used, preset)
    kept_rows = np.array([not is_left_out(flaws.get(one.name, "")) for one in attributes], bool)
    kept = np.array([not is_left_out(unit_flaws.get(unit, "")) for unit in range(units)], bool)
    if preset.length > LONGEST_PRODUCT:
        result, share = measure_in_double_precision(used, targets, np.arange(units), preset, block)
    else:
        found = measure_in_single_precision(used, targets, preset, block)
        settle_near_ties(
            found,
            used,
            targets,
            preset,
            rows=np.flatnonzero(kept_rows),
            columns=np.flatnonzero(kept),
            silent=[unit for unit, flaw in unit_flaws.items() if is_silent(flaw)],
        )
        result, share = found.distance, found.share
    for array in (result, share):
        array[~kept_rows] = array[:, ~kept] = np.nan
    seeds = tuple(episode.seed for episode in used)
    return UnitDiscrepancies(result, share, seeds, skipped, flaws, unit_flaws)


def measure_discrepancies(
    episode: MonitoredEpisode, attributes: Sequence[Attribute], preset: MatchingPreset
) -> Floats:
    """Compute the discrepancies of J attributes and U units over one episode, shape (J, U).

    As `match_units` does, but in this thread alone, and without changing how many threads other libraries
    use. The episode is at least one window long.
    """
    (target,) = scaled_attribute_series([episode], attributes, preset)
    (series,) = scaled_activation_series([episode], slice(None), preset)
    return compare_spectra(EpisodeSpectra(target, preset), EpisodeSpectra(series, preset))[0]
