"""Imprints: stimulations that show the network a state that it is not in.

The units that best tell apart the values of an attribute are overwritten with their mean activations at one
of the values. A policy that corrects what it sees, such as its heading, then keeps correcting it. Activation
steering of language models adds the same contrast of mean activations instead of overwriting with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, wrap_angle
from pdtui.core.units import Stimulation
from pdtui.search.stimulation_sampler import round_outputs
from pdtui.spectra.episode_monitor import MonitoredEpisode

_FLOOR = 0.05
"""Added to the spread within parts, so that a nearly silent unit does not count as telling."""


@dataclass(frozen=True)
class ImprintSettings:
    """How many imprints to build.

    Attributes:
        episodes: number of short episodes from the reset on, in which attributes still vary.
        steps: control steps of each episode.
        bins: number of parts into which an attribute's range is divided.
        units: numbers of units to overwrite.
        factors: factors on the difference between a part's mean activations and those of all episodes.
    """

    episodes: int = 64
    steps: int = 70
    bins: int = 6
    units: tuple[int, ...] = (8, 24, 64)
    factors: tuple[float, ...] = (1.0, 2.0)


def build_imprint_candidates(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    layers: Sequence[int],
    settings: ImprintSettings,
    largest: float,
) -> tuple[Stimulation, ...]:
    """Build stimulations that show each part of each attribute's range, in the first layer and in all layers.

    Torques are left out, because the units cause them.

    Args:
        episodes: monitored episodes.
        attributes: attributes of the robot.
        layers: widths of the hidden layers.
        settings: how many to build.
        largest: largest |v|.
    """
    activations = np.concatenate([episode.activations for episode in episodes])
    values = np.concatenate([episode.attributes for episode in episodes])
    mean = activations.mean(axis=0)
    groups = [range(layers[0])] if len(layers) == 1 else [range(layers[0]), range(sum(layers))]
    plans: dict[Stimulation, None] = {}
    for column, attribute in enumerate(attributes):
        if attribute.unit == "N m" or not np.isfinite(values[:, column]).all():
            continue
        part = assign_range_bins(values[:, column], attribute, settings.bins)
        shown, telling = _contrast(activations, part)
        for row in shown:
            for group in groups:
                order = np.array(group)[np.argsort(-telling[group.start : group.stop], kind="stable")]
                for count in settings.units:
                    chosen = np.sort(order[:count])
                    for factor in settings.factors:
                        outputs = np.clip(mean + factor * (row - mean), -largest, largest)[chosen]
                        plans[Stimulation(tuple(chosen.tolist()), round_outputs(outputs))] = None
    return tuple(plans)


def assign_range_bins(values: Floats, attribute: Attribute, count: int) -> NDArray[np.intp]:
    """Return the part of its range that each value is in, 0 to `count` − 1, shape (T,).

    The range of an angle that wraps is cut into equal arcs, any other into parts with equally many values.
    """
    if attribute.wraps:
        turned = np.array([wrap_angle(float(value)) for value in values])
        return np.clip(((turned + np.pi) / (2 * np.pi) * count).astype(np.intp), 0, count - 1)
    edges = np.quantile(values, np.arange(1, count) / count)
    return np.searchsorted(edges, values, side="right")


def _contrast(activations: NDArray[np.float32], part: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return the mean activations in each part that occurs, and how well each unit tells the parts apart.

    The latter is the spread of the means relative to the spread within parts; a unit that only follows the
    gait varies within each part.
    """
    groups = [activations[part == number] for number in np.unique(part)]
    means: Floats = np.array([group.mean(axis=0, dtype=np.float64) for group in groups])
    within = np.mean([group.std(axis=0, dtype=np.float64) for group in groups], axis=0)
    return means, means.std(axis=0) / (within + _FLOOR)
