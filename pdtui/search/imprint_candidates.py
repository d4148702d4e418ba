"""Directions in a layer: show the network a state that it is not in.

Units that tell the values of an attribute apart are overwritten with what they put out, on average, while
the attribute had another value. A policy that corrects what it sees (its heading, say) then goes on
correcting, and one weak unit becomes a strong behavior of many. The same contrast of mean activations is
known from language models as activation steering; here it overwrites rather than adds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.angles import wrap_angle
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.units import Stimulation
from pdtui.search.stimulation_sampler import round_to_three_digits
from pdtui.spectra.monitor import MonitoredEpisode

_FLOOR = 0.05


@dataclass(frozen=True)
class ImprintSettings:
    """How many imprints there are.

    Attributes:
        episodes: short ones, from the reset on, in which attributes still vary.
        steps: control steps of each.
        bins: parts into which the values of an attribute are cut.
        units: how many of the best units an imprint overwrites.
        factors: how far beyond the mean activation of that part it goes.
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
    """Stimulations that show each part of each attribute's range, in the first layer and in all.

    Torques are left out: what a unit knows of them, it commands.

    Args:
        episodes: monitored, unstimulated.
        attributes: of the robot.
        layers: widths of the hidden layers.
        settings: how many.
        largest: |v| at most.
    """
    activations = np.concatenate([episode.activations for episode in episodes])
    values = np.concatenate([episode.attributes for episode in episodes])
    mean = activations.mean(axis=0)
    groups = [range(layers[0])] if len(layers) == 1 else [range(layers[0]), range(sum(layers))]
    plans: dict[Stimulation, None] = {}
    for column, attribute in enumerate(attributes):
        if attribute.unit == "N m" or not np.isfinite(values[:, column]).all():
            continue
        part = range_parts(values[:, column], attribute, settings.bins)
        shown, telling = _contrast(activations, part)
        for row in shown:
            for group in groups:
                order = np.array(group)[np.argsort(-telling[group.start : group.stop], kind="stable")]
                for count in settings.units:
                    chosen = np.sort(order[:count])
                    for factor in settings.factors:
                        outputs = np.clip(mean + factor * (row - mean), -largest, largest)[chosen]
                        rounded = [round_to_three_digits(v) for v in outputs.tolist()]
                        plans[Stimulation(tuple(chosen.tolist()), tuple(rounded))] = None
    return tuple(plans)


def range_parts(values: Floats, attribute: Attribute, count: int) -> NDArray[np.intp]:
    """Which part of its range each value is in, 0 to `count` − 1, shape (T,).

    An angle that wraps is cut into equal arcs, anything else into parts that hold equally many values.
    """
    if attribute.wraps:
        turned = np.array([wrap_angle(float(value)) for value in values])
        return np.clip(((turned + np.pi) / (2 * np.pi) * count).astype(np.intp), 0, count - 1)
    edges = np.quantile(values, np.arange(1, count) / count)
    return np.searchsorted(edges, values, side="right")


def _contrast(activations: NDArray[np.float32], part: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Mean activations in each part that occurs, and how well each unit tells the parts apart.

    The latter is the spread of the means over the spread within the parts: a unit that only follows the gait
    varies within each of them.
    """
    groups = [activations[part == number] for number in np.unique(part)]
    means: Floats = np.array([group.mean(axis=0, dtype=np.float64) for group in groups])
    within = np.mean([group.std(axis=0, dtype=np.float64) for group in groups], axis=0)
    return means, means.std(axis=0) / (within + _FLOOR)
