"""The numbers behind the pictures of a dissection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.core.units import format_unit
from pdtui.dissection.dissection_result import Dissection
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import short_time_transform

DECIBELS = 60.0
"""Range of a spectrogram's colors below its strongest cell, dB."""
RANKED = 12
"""Number of units that a ranking shows."""
STRONG = 3.0
"""Side effect, in standard deviations, that gets the strongest color; with a higher limit, the torques of a
robot that otherwise hardly moves would make all else pale."""


@dataclass(frozen=True)
class SpectrogramChart:
    """Spectrogram of one series.

    Attributes:
        times: Middle of each window in s, shape (D,).
        frequencies: Frequencies in Hz, shape (F,).
        decibels: ``20 log10 |STFT|``, whether the preset compares magnitudes or powers, shape (D, F); −inf
            where the transform is zero.
    """

    times: Floats
    frequencies: Floats
    decibels: Floats


@dataclass(frozen=True)
class MatchedSpectrograms:
    """Spectrograms of an attribute and of the unit that matches it best, over the same episode.

    Attributes:
        attribute: The attribute, at the scale at which matching compares it.
        unit, label: Flat index and address of the unit.
        low, high: Range of the colors that both share, dB.
    """

    attribute: Attribute
    unit: int
    label: str
    of_attribute: SpectrogramChart
    of_unit: SpectrogramChart
    low: float
    high: float


@dataclass(frozen=True)
class EffectCurve:
    """Change of one attribute with the output v of one unit, relative to unstimulated roll-outs.

    Attributes:
        role: Why the unit is shown.
        values: Outputs v in ascending order, shape (D,).
        means: Mean change over the starts whose roll-outs reached the measured steps, shape (D,); NaN where
            none did.
        lows, highs: 95 % bootstrap interval of the mean, shape (D,); NaN for fewer than two such starts.
        falls: Share of the starts from which the robot fell, shape (D,).
        matched: Whether the unit is the attribute's best match.
    """

    label: str
    role: str
    values: Floats
    means: Floats
    lows: Floats
    highs: Floats
    falls: Floats
    matched: bool


@dataclass(frozen=True)
class SideEffectMatrix:
    """What N units do to each of J attributes, in standard deviations of the attribute.

    Attributes:
        units: Addresses, grouped by the attribute that each unit moves most, the strongest first.
        by_value: One matrix per output v, shape (N, J); NaN for an attribute that never varies.
    """

    units: tuple[str, ...]
    attributes: tuple[str, ...]
    by_value: dict[float, Floats]

    @property
    def limit(self) -> float:
        """Value at which the colors end: the largest magnitude, but at most `STRONG`."""
        sizes = [np.abs(np.nan_to_num(matrix)).max(initial=0.0) for matrix in self.by_value.values()]
        return min(STRONG, max([*map(float, sizes), 1e-9]))


def compute_spectrogram_chart(
    series: NDArray[np.floating], preset: MatchingPreset, dt: float
) -> SpectrogramChart:
    """Return the spectrogram of one series, shape (T,), of samples `dt` seconds apart.

    Frequencies that the preset does not compare are set to zero.
    """
    magnitude = np.abs(short_time_transform(series[:, None], preset)[0])
    magnitude[:, : preset.first_bin] = 0.0
    with np.errstate(divide="ignore"):
        decibels = 20 * np.log10(magnitude)
    times = (np.arange(len(magnitude), dtype=np.float64) * preset.hop + preset.length / 2) * dt
    return SpectrogramChart(times, preset.frequencies(dt), decibels)


def matched_spectrograms(dissection: Dissection, column: int) -> MatchedSpectrograms | None:
    """Return the spectrograms of an attribute and its best match; None where no unit matches."""
    ranked = dissection.matching.ranked_units(column)
    if not ranked.size:
        return None
    unit, shown = int(ranked[0]), dissection.sample_episode
    series = shown.compared_attributes[:, column], shown.compared_activations[:, shown.column(unit)]
    one, other = (compute_spectrogram_chart(values, dissection.preset, dissection.dt) for values in series)
    both = np.concatenate([one.decibels.ravel(), other.decibels.ravel()])
    heard = both[np.isfinite(both)]
    high = float(heard.max()) if heard.size else 0.0
    label = format_unit(unit, dissection.layers)
    attribute = dissection.attributes[column]
    return MatchedSpectrograms(attribute, unit, label, one, other, high - DECIBELS, high)


def rank_nearest_units(dissection: Dissection, column: int) -> tuple[list[str], Floats, Floats]:
    """Return the units nearest to an attribute; none for an attribute that matching left out.

    They are addresses, discrepancies, and the shares of the squared distances that are mean level.
    """
    matching = dissection.matching
    ranked = matching.ranked_units(column)[:RANKED]
    labels = [format_unit(int(unit), dissection.layers) for unit in ranked]
    return labels, matching.discrepancy[column, ranked], matching.level_share[column, ranked]


def compute_effect_curves(dissection: Dissection, column: int) -> list[EffectCurve]:
    """Return the effect curves of the unit that moves an attribute most and of its first match."""
    probed = dissection.judgment.of_attribute(column)[:1]
    ranked = dissection.matching.ranked_units(column)
    roles: dict[int, list[str]] = {}
    for one in probed:
        roles[one.unit] = ["best probed"]
    if ranked.size:
        roles.setdefault(int(ranked[0]), []).append("first match")
    return [_curve(dissection, column, unit, " and ".join(role)) for unit, role in roles.items()]


def _curve(dissection: Dissection, column: int, unit: int, role: str) -> EffectCurve:
    refined = dissection.refined
    row = refined.units.index(unit)
    samples = refined.effects[row, :, :, column]
    known = np.isfinite(samples)
    intervals = [bootstrap_interval(some, dissection.seed) for some in samples]
    lows, highs = np.array(intervals, np.float64).T
    means = [
        float(some[finite].mean()) if finite.any() else float("nan")
        for some, finite in zip(samples, known, strict=True)
    ]
    order = np.argsort(refined.values)
    return EffectCurve(
        format_unit(unit, dissection.layers),
        role,
        np.array(refined.values, np.float64)[order],
        np.array(means)[order],
        lows[order],
        highs[order],
        refined.falls[row].mean(axis=-1)[order],
        unit in dissection.matching.ranked_units(column)[:1],
    )


def side_effect_matrix(dissection: Dissection) -> SideEffectMatrix:
    """Return the side effects of the refined units."""
    units, by_value = dissection.refined.units, dissection.side_effects()
    nothing = np.zeros((len(units), len(dissection.attributes)))
    sizes = np.max([nothing, *(np.abs(np.nan_to_num(matrix)) for matrix in by_value.values())], axis=0)
    order = np.lexsort((-sizes.max(axis=1), sizes.argmax(axis=1)))
    return SideEffectMatrix(
        tuple(format_unit(units[row], dissection.layers) for row in order),
        tuple(attribute.name for attribute in dissection.attributes),
        {value: matrix[order] for value, matrix in by_value.items()},
    )
