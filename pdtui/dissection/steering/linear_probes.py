"""Linear probes: how well a layer's outputs tell an attribute, and along which direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, wrap_angles
from pdtui.spectra.episode_monitor import MonitoredEpisode

WIDEST_LAYER = 2048
"""Units of the widest layer that probes are fitted to; of a wider one, they would take minutes."""
_PENALTIES = tuple(10.0**power for power in range(-5, 2))
"""Penalties that are tried, in mean variances of a unit times the number of steps."""
_BLOCKS = 5
"""Parts into which an only episode is divided."""
_THIRD = 1.0 / 3.0


@dataclass(frozen=True, eq=False)
class LinearProbe:
    """A ridge regression of one attribute on the outputs of one layer, and the difference of its means.

    Attributes:
        column: Column of the attribute.
        layer: Index of the layer.
        weights: Attribute per output, shape (n,) for a layer of n units.
        intercept: The attribute where all outputs are 0.
        r2: Share of the attribute's variance that it predicts in episodes that it was not fitted to. It is
            negative where their mean would have been the better guess.
        mean_difference: Mean outputs where the attribute is in its highest third minus those where it is in
            its lowest, shape (n,).
        mean: The attribute's mean over the monitored steps.
        deviation: Its standard deviation.
        layer_spread: Root of the summed variances of the layer's outputs: how far they usually are from their
            mean.
    """

    column: int
    layer: int
    weights: Floats
    intercept: float
    r2: float
    mean_difference: Floats
    mean: float
    deviation: float
    layer_spread: float


def fit_linear_probes(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    layers: Sequence[int],
    columns: Sequence[int],
    count: int = 1,
) -> tuple[LinearProbe, ...]:
    """Fit a probe of each attribute to each layer, and return those of the best layers for each attribute.

    The penalty is chosen by how well a probe predicts each episode from the others. A single episode is
    divided into blocks.

    Args:
        episodes: Monitored episodes.
        attributes: All attributes of the robot.
        layers: Widths of the policy's hidden layers.
        columns: Columns of the attributes to fit.
        count: Number of layers to keep for each attribute.

    Returns:
        Probes for each column whose attribute varies, the best first; none of layers wider than
        `WIDEST_LAYER`.
    """
    values = [_target_values(episode, attributes, columns) for episode in episodes if episode.steps]
    outputs = [episode.activations.astype(np.float64) for episode in episodes if episode.steps]
    if len(outputs) == 1:
        values, outputs = np.array_split(values[0], _BLOCKS), np.array_split(outputs[0], _BLOCKS)
    found: dict[int, list[LinearProbe]] = {}
    first = 0
    for layer, width in enumerate(layers):
        units, first = slice(first, first + width), first + width
        if width > WIDEST_LAYER:
            continue
        for probe in _fit_layer([one[:, units] for one in outputs], values, layer, columns):
            found.setdefault(probe.column, []).append(probe)
    ranked = {column: sorted(own, key=lambda one: -one.r2) for column, own in found.items()}
    return tuple(probe for column in columns for probe in ranked.get(column, [])[:count])


def _target_values(
    episode: MonitoredEpisode, attributes: Sequence[Attribute], columns: Sequence[int]
) -> Floats:
    """Return what is fitted, shape (T, C): an angle within half a turn, as the policy observes it."""
    values = episode.attributes[:, list(columns)].copy()
    for number, column in enumerate(columns):
        if attributes[column].wraps:
            values[:, number] = wrap_angles(values[:, number])
    return values


def _fit_layer(
    outputs: Sequence[Floats], values: Sequence[Floats], layer: int, columns: Sequence[int]
) -> list[LinearProbe]:
    scores = _cross_validate(outputs, values)
    everything, targets = np.concatenate(outputs), np.concatenate(values)
    spread = float(np.sqrt(everything.var(axis=0).sum()))
    fits = _fit_ridge(everything, targets)
    probes = []
    for number, column in enumerate(columns):
        one, deviation = targets[:, number], float(targets[:, number].std())
        if deviation == 0.0 or spread == 0.0:
            continue
        chosen = int(scores[:, number].argmax())
        weights = fits[chosen][:, number]
        low, high = np.quantile(one, [_THIRD, 1.0 - _THIRD])
        difference = everything[one >= high].mean(axis=0) - everything[one <= low].mean(axis=0)
        intercept = float(one.mean() - everything.mean(axis=0) @ weights)
        score = float(scores[chosen, number])
        probes.append(
            LinearProbe(
                column, layer, weights, intercept, score, difference, float(one.mean()), deviation, spread
            )
        )
    return probes


def _cross_validate(outputs: Sequence[Floats], values: Sequence[Floats]) -> NDArray[np.float64]:
    """Return the share of the variance that is predicted in what is left out, shape (penalties, C)."""
    missed = np.zeros((len(_PENALTIES), values[0].shape[1]))
    varied = np.zeros(values[0].shape[1])
    for left_out in range(len(outputs)):
        others = [number for number in range(len(outputs)) if number != left_out]
        x, y = (np.concatenate([some[number] for number in others]) for some in (outputs, values))
        centered = outputs[left_out] - x.mean(axis=0)
        away = values[left_out] - y.mean(axis=0)
        varied += (away**2).sum(axis=0)
        for number, weights in enumerate(_fit_ridge(x, y)):
            missed[number] += ((away - centered @ weights) ** 2).sum(axis=0)
    return np.asarray(1.0 - np.divide(missed, varied, out=np.ones_like(missed), where=varied > 0))


def _fit_ridge(x: Floats, y: Floats) -> list[Floats]:
    """Return the weights for each penalty, shape (n, C) each (Hoerl and Kennard, 1970)."""
    centered, away = x - x.mean(axis=0), y - y.mean(axis=0)
    sizes, axes = np.linalg.eigh(centered.T @ centered)
    products = axes.T @ (centered.T @ away)
    unit = max(float(np.mean(sizes)), np.finfo(np.float64).tiny)
    return [axes @ (products / (np.maximum(sizes, 0.0) + penalty * unit)[:, None]) for penalty in _PENALTIES]
