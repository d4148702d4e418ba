"""What is wrong with recorded series: not finite, constant, or never firing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.attributes import Attribute
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import map_on_cores

_CONSTANT = {
    True: "constant in every episode; only its level can match",
    False: "constant in every episode, and levels do not count; left out",
}
"""What is wrong with a constant series, by whether levels count."""
_SILENT = "never fires"


def find_attribute_flaws(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], preset: MatchingPreset
) -> dict[str, str]:
    """Return what is wrong with attributes, by name."""
    flaws: dict[str, str] = {}
    for column, attribute in enumerate(attributes):
        series = [episode.attributes[:, column] for episode in episodes]
        broken = [one.seed for one in episodes if not np.isfinite(one.attributes[:, column]).all()]
        if broken:
            flaws[attribute.name] = f"not finite in the episodes of seeds {broken}; left out"
        elif all(np.ptp(values) == 0 for values in series):
            flaws[attribute.name] = _CONSTANT[_levels_count(preset)]
    return flaws


def find_unit_flaws(episodes: Sequence[MonitoredEpisode], preset: MatchingPreset) -> dict[int, str]:
    """Return what is wrong with units, by flat index."""
    high = np.array(list(map_on_cores(lambda episode: episode.activations.max(axis=0), episodes)))
    low = np.array(list(map_on_cores(lambda episode: episode.activations.min(axis=0), episodes)))
    finite = np.isfinite(high).all(axis=0) & np.isfinite(low).all(axis=0)
    still = (high == low).all(axis=0)
    flaws: dict[int, str] = {}
    for unit in np.flatnonzero(still | ~finite).tolist():
        if not finite[unit]:
            flaws[unit] = "not finite; left out"
        elif (high[:, unit] == 0).all():
            flaws[unit] = _SILENT + ("" if _levels_count(preset) else "; left out")
        else:
            flaws[unit] = _CONSTANT[_levels_count(preset)]
    return flaws


def is_left_out(flaw: str) -> bool:
    """Return whether a series with this flaw is left out of matching."""
    return flaw.endswith("left out")


def is_silent(flaw: str) -> bool:
    """Return whether this flaw is that of a unit that never fires."""
    return flaw.startswith(_SILENT)


def _levels_count(preset: MatchingPreset) -> bool:
    return preset.level == "kept" and preset.scaling != "standardized"
