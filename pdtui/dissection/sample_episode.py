"""The part of a monitored episode that a dissection keeps for its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.spectra.matching import Discrepancies
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.monitor import MonitoredEpisode
from pdtui.spectra.scaled_series import attribute_series, unit_series, usable_episodes

_MATCHES = 3


@dataclass(frozen=True)
class SampleEpisode:
    """One monitored episode, with the activations of some units only.

    Attributes:
        seed: Seed of the reset.
        units: Flat indices of the units, ascending.
        activations: Activations of these units, shape (T, len(units)).
        attributes: Attributes in their units, with angles unwrapped, shape (T, J).
        compared_activations, compared_attributes: Both, at the scale at which the preset compares them.
    """

    seed: int
    units: tuple[int, ...]
    activations: NDArray[np.float32]
    attributes: Floats
    compared_activations: Floats
    compared_attributes: Floats

    def column(self, unit: int) -> int:
        """Return the column of a unit, given by its flat index.

        Raises:
            ValueError: The unit was not kept.
        """
        return self.units.index(unit)


def pick_sample_episode(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    matching: Discrepancies,
    preset: MatchingPreset,
    matches: int = _MATCHES,
) -> SampleEpisode:
    """Return the first episode that matching used, with the units that match each attribute best.

    Args:
        episodes: The monitored episodes.
        attributes: The robot's attributes.
        matching: Result of matching.
        preset: Preset of matching.
        matches: Number of units kept for each attribute.
    """
    nearest = (matching.ranked_units(column)[:matches] for column in range(len(matching.discrepancy)))
    units = sorted({int(unit) for few in nearest for unit in few})
    few = [replace(one, activations=one.activations[:, units]) for one in usable_episodes(episodes, preset)]
    compared = unit_series(few, slice(None), preset)[0] if units else few[0].activations
    return SampleEpisode(
        few[0].seed,
        tuple(units),
        few[0].activations,
        few[0].attributes,
        np.asarray(compared, np.float64),
        attribute_series(few, attributes, preset)[0],
    )
