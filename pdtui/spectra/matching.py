"""Step 3, match: the distance between the spectrograms of units and attributes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PolicyError
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import (
    BLOCK,
    map_unit_blocks,
    scaled_activation_series,
    scaled_attribute_series,
    short_time_transform,
    spectrogram,
    usable_episodes,
)

# ``|a|² + |b|² − 2ab`` loses digits where a and b are close. Below this share of ``|a|² + |b|²`` the
# difference itself is squared, so that relative errors stay under 1e-9.
_NEAR = 1e-6
_CONSTANT = {
    True: "constant in every episode; only its level can match",
    False: "constant in every episode, and levels do not count; left out",
}
"""What is wrong with a constant series, by whether levels count."""


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
    block: int = BLOCK,
) -> UnitDiscrepancies:
    """Compute ``Dis(z, s) = ‖SG_z − SG_s‖₂`` of all units z and attributes s (section 3.2).

    The norm is over all frequencies and windows, and its mean is taken over the episodes. Time grows linearly
    with units, attributes and episodes; memory grows by one block of units per core.
    Results depend on the size of a block only by rounding.

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
    targets = [_Spectra(series, preset) for series in scaled_attribute_series(used, attributes, preset)]

    def compare(units: slice) -> tuple[Floats, Floats, dict[int, str]]:
        distance = share = np.zeros((len(attributes), units.stop - units.start))
        for target, series in zip(targets, scaled_activation_series(used, units, preset), strict=True):
            one_distance, one_share = _compare(target, _Spectra(series, preset))
            distance, share = distance + one_distance, share + one_share
        return distance / len(used), share / len(used), _find_unit_flaws(used, units, preset)

    units = used[0].activations.shape[1]
    result = np.empty((len(attributes), units))
    level_share = np.empty_like(result)
    unit_flaws: dict[int, str] = {}
    for part, (distance, share, flaws) in map_unit_blocks(compare, units, block):
        result[:, part], level_share[:, part] = distance, share
        unit_flaws |= flaws
    attribute_flaws = _find_flaws(used, attributes, preset)
    for row, attribute in enumerate(attributes):
        if attribute_flaws.get(attribute.name, "").endswith("left out"):
            result[row] = level_share[row] = np.nan
    for unit, flaw in unit_flaws.items():
        if flaw.endswith("left out"):
            result[:, unit] = level_share[:, unit] = np.nan
    return UnitDiscrepancies(
        result, level_share, tuple(episode.seed for episode in used), skipped, attribute_flaws, unit_flaws
    )


def measure_discrepancies(
    episode: MonitoredEpisode, attributes: Sequence[Attribute], preset: MatchingPreset
) -> Floats:
    """Compute the discrepancies of J attributes and U units over one episode, shape (J, U).

    As `match_units` does, but in this thread alone, and without changing how many threads other libraries
    use. The episode is at least one window long.
    """
    (target,) = scaled_attribute_series([episode], attributes, preset)
    (series,) = scaled_activation_series([episode], slice(None), preset)
    return _compare(_Spectra(target, preset), _Spectra(series, preset))[0]


class _Spectra:
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
def _compare(targets: _Spectra, units: _Spectra) -> tuple[Floats, Floats]:
    """Return distances and level shares of one episode, shape (J, B) each; shares are NaN without levels."""
    sums = targets.squares[:, None] + units.squares
    total = sums - 2.0 * (targets.all @ units.all.T)
    level = targets.level_squares[:, None] + units.level_squares - 2.0 * (targets.level @ units.level.T)
    for row, column in zip(*np.nonzero(total < _NEAR * sums), strict=True):
        total[row, column] = np.square(units.all[column] - targets.all[row]).sum()
        level[row, column] = np.square(units.level[column] - targets.level[row]).sum()
    if not targets.levels_count:
        return np.sqrt(total), np.full_like(total, np.nan)
    share = np.divide(level, total, out=np.zeros_like(total), where=total > 0)
    return np.sqrt(total), np.clip(share, 0.0, 1.0)


def _find_flaws(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], preset: MatchingPreset
) -> dict[str, str]:
    flaws: dict[str, str] = {}
    for column, attribute in enumerate(attributes):
        series = [episode.attributes[:, column] for episode in episodes]
        broken = [one.seed for one in episodes if not np.isfinite(one.attributes[:, column]).all()]
        if broken:
            flaws[attribute.name] = f"not finite in the episodes of seeds {broken}; left out"
        elif all(np.ptp(values) == 0 for values in series):
            flaws[attribute.name] = _CONSTANT[_levels_count(preset)]
    return flaws


def _find_unit_flaws(
    episodes: Sequence[MonitoredEpisode], units: slice, preset: MatchingPreset
) -> dict[int, str]:
    high = np.array([episode.activations[:, units].max(axis=0) for episode in episodes])
    low = np.array([episode.activations[:, units].min(axis=0) for episode in episodes])
    finite = np.isfinite(high).all(axis=0) & np.isfinite(low).all(axis=0)
    still = (high == low).all(axis=0)
    flaws: dict[int, str] = {}
    for number in np.flatnonzero(still | ~finite):
        unit = units.start + int(number)
        if not finite[number]:
            flaws[unit] = "not finite; left out"
        elif (high[:, number] == 0).all():
            flaws[unit] = "never fires" + ("" if _levels_count(preset) else "; left out")
        else:
            flaws[unit] = _CONSTANT[_levels_count(preset)]
    return flaws


def _levels_count(preset: MatchingPreset) -> bool:
    return preset.level == "kept" and preset.scaling != "standardized"
