"""What is kept of the monitored episodes: enough to show a match, little enough to keep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pdtui.dissection.matching import Match
from pdtui.dissection.monitor import Episode
from pdtui.dissection.series import attribute_series, unit_series, usable
from pdtui.dissection.spectrum import Preset
from pdtui.robots.types import Attribute, Floats

_MATCHES = 3


@dataclass(frozen=True)
class Excerpt:
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


def excerpt(
    episodes: Sequence[Episode],
    attributes: Sequence[Attribute],
    matching: Match,
    preset: Preset,
    matches: int = _MATCHES,
) -> Excerpt:
    """The first episode that counted in matching, with the nearest units of every attribute.

    Args:
        episodes: as they were matched.
        attributes: of the robot.
        matching: what came of it.
        preset: by which.
        matches: how many units of each attribute.
    """
    nearest = (matching.ranked(column)[:matches] for column in range(len(matching.discrepancy)))
    units = sorted({int(unit) for few in nearest for unit in few})
    few = [replace(one, activations=one.activations[:, units]) for one in usable(episodes, preset)]
    compared = unit_series(few, slice(None), preset)[0] if units else few[0].activations
    return Excerpt(
        few[0].seed,
        tuple(units),
        few[0].activations,
        few[0].attributes,
        np.asarray(compared, np.float64),
        attribute_series(few, attributes, preset)[0],
    )
