"""The numbers behind every picture, whoever draws it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.intervals import bootstrap_interval
from pdtui.core.units import format_unit
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.sample_episode import SampleEpisode
from pdtui.probing.confirmation import rank_probed_units
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.spectrogram import short_time_transform

DECIBELS = 60.0
"""Range of a spectrogram's colours below its loudest cell."""
RANKED = 12
"""Units of a ranking that are drawn."""
STRONG = 3.0
"""Deviations from which a side effect has the strongest colour: beyond, only the torques of a robot that else
hardly moves would show."""


@dataclass(frozen=True)
class SpectrogramChart:
    """One series in time and frequency.

    Attributes:
        times: middle of each window, s, shape (D,).
        frequencies: Hz, shape (F,).
        decibels: ``20 log10 |STFT|``, whether the preset compares magnitude or power; −inf where there is
            nothing; shape (D, F).
    """

    times: Floats
    frequencies: Floats
    decibels: Floats


@dataclass(frozen=True)
class MatchedPair:
    """An attribute and the unit that matches it best, over the same episode.

    Attributes:
        attribute: at the scale at which matching compares it.
        unit: its flat index.
        label: its address.
        of_attribute, of_unit: their spectrograms.
        low, high: range of the colours that both share, dB.
    """

    attribute: Attribute
    unit: int
    label: str
    of_attribute: SpectrogramChart
    of_unit: SpectrogramChart
    low: float
    high: float


@dataclass(frozen=True)
class UnitRanking:
    """Units by discrepancy with one attribute, the nearest first.

    Attributes:
        labels: addresses.
        discrepancies: shape (N,).
        level_shares: part of the squared distance that is mean level, shape (N,).
    """

    labels: tuple[str, ...]
    discrepancies: Floats
    level_shares: Floats


@dataclass(frozen=True)
class EffectCurve:
    """Change of one attribute over the output v of one unit, against the untouched roll-out.

    Attributes:
        label: address of the unit.
        role: why it is shown.
        values: v, ascending, shape (D,).
        means: over the starts that did not end before the measured steps; NaN where all did, shape (D,).
        lows, highs: 95 % bootstrap interval of the mean, NaN for fewer than two such starts, shape (D,).
        falls: share of the starts from which the robot fell, shape (D,).
        matched: whether the unit is the attribute's best match.
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
    """What the units do to every attribute, in parts of the attribute's usual spread.

    Attributes:
        units: addresses; grouped by the attribute that each moves most, the strongest first.
        attributes: names.
        by_value: for each output v a matrix, shape (N, J); NaN for an attribute that never varies.
    """

    units: tuple[str, ...]
    attributes: tuple[str, ...]
    by_value: dict[float, Floats]

    @property
    def limit(self) -> float:
        """Where the colours end: at the largest magnitude, or at `STRONG` deviations if that is more."""
        sizes = [np.abs(np.nan_to_num(matrix)).max(initial=0.0) for matrix in self.by_value.values()]
        return min(STRONG, max([*map(float, sizes), 1e-9]))


def spectrogram_of(series: NDArray[np.floating], preset: MatchingPreset, dt: float) -> SpectrogramChart:
    """Spectrogram of one series, shape (T,), of samples `dt` seconds apart.

    Frequencies that the preset does not compare are left out as if there was nothing.
    """
    magnitude = np.abs(short_time_transform(series[:, None], preset)[0])
    magnitude[:, : preset.first_bin] = 0.0
    with np.errstate(divide="ignore"):
        decibels = 20 * np.log10(magnitude)
    times = (np.arange(len(magnitude), dtype=np.float64) * preset.hop + preset.length / 2) * dt
    return SpectrogramChart(times, preset.frequencies(dt), decibels)


def matched_pair(dissection: Dissection, column: int) -> MatchedPair | None:
    """Spectrograms of an attribute and its best match; None for an attribute that nothing matches."""
    ranked = dissection.matching.ranked_units(column)
    if not ranked.size:
        return None
    unit, shown = int(ranked[0]), dissection.sample_episode
    series = shown.compared_attributes[:, column], shown.compared_activations[:, shown.column(unit)]
    one, other = (spectrogram_of(values, dissection.preset, dissection.dt) for values in series)
    both = np.concatenate([one.decibels.ravel(), other.decibels.ravel()])
    heard = both[np.isfinite(both)]
    high = float(heard.max()) if heard.size else 0.0
    label = format_unit(unit, dissection.layers)
    return MatchedPair(dissection.attributes[column], unit, label, one, other, high - DECIBELS, high)


def unit_ranking(dissection: Dissection, column: int, count: int = RANKED) -> UnitRanking:
    """The nearest units of an attribute; none for one that was left out."""
    matching = dissection.matching
    ranked = matching.ranked_units(column)[:count]
    return UnitRanking(
        tuple(format_unit(int(unit), dissection.layers) for unit in ranked),
        matching.discrepancy[column, ranked],
        matching.level_share[column, ranked],
    )


def effect_curves(dissection: Dissection, column: int) -> list[EffectCurve]:
    """Effect curves of the unit that moves an attribute most and of its first match."""
    probed = rank_probed_units(column, dissection.screen, dissection.refined, dissection.seed)[:1]
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
    means, lows, highs, falls = [], [], [], []
    order = np.argsort(refined.values)
    for dose in order:
        samples = refined.effects[row, dose, :, column]
        known = samples[np.isfinite(samples)]
        low, high = bootstrap_interval(samples, dissection.seed)
        means.append(float(known.mean()) if known.size else float("nan"))
        lows.append(low)
        highs.append(high)
        falls.append(float(refined.falls[row, dose].mean()))
    return EffectCurve(
        format_unit(unit, dissection.layers),
        role,
        np.array(refined.values, np.float64)[order],
        np.array(means),
        np.array(lows),
        np.array(highs),
        np.array(falls),
        unit in dissection.matching.ranked_units(column)[:1],
    )


def side_effect_matrix(dissection: Dissection) -> SideEffectMatrix:
    """The matrix of the refined units, without those that are only the random control group."""
    refined = dissection.refined
    chosen = set(refined.units) - set(dissection.controls)
    for column in range(len(dissection.attributes)):
        chosen.update(dissection.matching.ranked_units(column)[:1].tolist())
        best = rank_probed_units(column, dissection.screen, refined, dissection.seed)[:1]
        chosen.update(one.unit for one in best)
    rows = [row for row, unit in enumerate(refined.units) if unit in chosen]
    by_value = {value: matrix[rows] for value, matrix in dissection.side_effects().items()}
    nothing = np.zeros((len(rows), len(dissection.attributes)))
    sizes = np.max([nothing, *(np.abs(np.nan_to_num(matrix)) for matrix in by_value.values())], axis=0)
    order = np.lexsort((-sizes.max(axis=1), sizes.argmax(axis=1)))
    return SideEffectMatrix(
        tuple(format_unit(refined.units[rows[row]], dissection.layers) for row in order),
        tuple(attribute.name for attribute in dissection.attributes),
        {value: matrix[order] for value, matrix in by_value.items()},
    )


def sample_times(shown: SampleEpisode, dt: float) -> Floats:
    """Time of each row of an excerpt since the reset, s: row t is the state after control step t."""
    times: Floats = (np.arange(len(shown.attributes), dtype=np.float64) + 1) * dt
    return times
