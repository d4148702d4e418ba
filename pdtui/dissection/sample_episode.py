"""What is kept of the monitored episodes: enough to show a match, little enough to keep."""

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
    """One monitored episode, of some units only.

    Attributes:
        seed: of the reset.
        units: flat indices, ascending.
        activations: of these units, shape (T, len(units)).
        attributes: in their physical units, angles unwrapped, shape (T, J).
        compared_activations, compared_attributes: both at the scale at which the preset compares them.
    """

    seed: int
    units: tuple[int, ...]
    activations: NDArray[np.float32]
    attributes: Floats
    compared_activations: Floats
    compared_attributes: Floats

    def column(self, unit: int) -> int:
        """Column of a unit by its flat index.

        Raises:
            ValueError: the unit was not kept.
        """
        return self.units.index(unit)


def pick_sample_episode(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    matching: Discrepancies,
    preset: MatchingPreset,
    matches: int = _MATCHES,
) -> SampleEpisode:
    """The first episode that counted in matching, with the nearest units of every attribute.

    Args:
        episodes: as they were matched.
        attributes: of the robot.
        matching: what came of it.
        preset: by which.
        matches: how many units of each attribute.
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
