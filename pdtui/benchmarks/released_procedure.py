"""What the authors' released function computes, written anew to compare its speed with ours."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdtui.benchmarks.optional_librosa import load_librosa
from pdtui.core.attributes import Attribute, Floats
from pdtui.pictures.matplotlib_page import load_pyplot
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset
from pdtui.spectra.phase_correlation import correlate_phases

_NEAREST = 5
_Entry = dict[str, Any]
_Spectrum = tuple[Floats, Floats]


@dataclass(frozen=True)
class ReleasedProcedureSpeedup:
    """Matching compared with the procedure of the authors' released code.

    Attributes:
        matching_ms: median time of our matching, ms.
        phases_ms: the same of matching and correlating phases, ms.
        released_ms: time of their procedure, which always does both, ms; it is run once.
        matching_ratio, phases_ratio: their time over each of ours.
        overlap: share of their five nearest units of each attribute that are among our five nearest, mean.
            They pad the series at both ends, so that it need not be 1.
    """

    matching_ms: float
    phases_ms: float
    released_ms: float
    matching_ratio: float
    phases_ratio: float
    overlap: float


def compare_with_released_procedure(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], rounds: int
) -> ReleasedProcedureSpeedup:
    """Time our matching, half of the rounds before and half after, and the released procedure once."""
    preset = find_matching_preset("authors")
    found = match_units(episodes, attributes, preset)
    correlate_phases(episodes, attributes, preset)
    matching, phases = [], []

    def measure_ours() -> None:
        for _ in range(max(1, rounds // 2)):
            start = time.perf_counter()
            match_units(episodes, attributes, preset)
            matched = time.perf_counter()
            correlate_phases(episodes, attributes, preset)
            matching.append(matched - start)
            phases.append(time.perf_counter() - start)

    measure_ours()
    start = time.perf_counter()
    released = run_released_procedure(episodes, attributes)
    seconds = time.perf_counter() - start
    measure_ours()
    means = np.mean(released, axis=0)
    shared = [
        len({*found.ranked_units(row)[:_NEAREST].tolist()} & {*np.argsort(distances)[:_NEAREST].tolist()})
        for row, distances in enumerate(means)
    ]
    ours, whole = float(np.median(matching)), float(np.median(phases))
    return ReleasedProcedureSpeedup(
        ours * 1e3,
        whole * 1e3,
        seconds * 1e3,
        seconds / ours,
        seconds / whole,
        float(np.mean(shared)) / _NEAREST,
    )


def run_released_procedure(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute]
) -> list[Floats]:
    """Do what the authors' function does, and return the discrepancies of each episode, shape (J, U) each.

    In each episode, every series is transformed by `librosa.stft` with windows of 32 samples, padded at both
    ends, after the figure was cleared in which it could be plotted, and magnitude and angle are kept. Then
    each pair is handled by itself: the attribute's predominant frequency, the wrapped difference of the
    phases there and ρ from its plain mean, and the norm of the difference of the magnitudes. Each result is
    entered into a list of the attribute and into one of the unit, and all lists are sorted by discrepancy.
    """
    pyplot = load_pyplot()
    librosa = load_librosa()

    def transform(series: Floats) -> _Spectrum:
        pyplot.clf()
        pyplot.cla()
        spectrum = librosa.stft(series, n_fft=32)
        return np.abs(spectrum), np.angle(spectrum)

    result = []
    for episode in episodes:
        units = [transform(series.astype(np.float64)) for series in episode.activations.T]
        targets = [
            transform(attribute.as_observed(series))
            for attribute, series in zip(attributes, episode.attributes.T, strict=True)
        ]
        by_unit: list[list[_Entry]] = [[] for _ in units]
        by_attribute = [_compare_pairs(target, units, by_unit) for target in targets]
        for entries in (*by_attribute, *by_unit):
            entries.sort(key=lambda entry: entry["discrepancy"])
        discrepancies = np.empty((len(targets), len(units)))
        for row, entries in enumerate(by_attribute):
            discrepancies[row, [entry["unit"] for entry in entries]] = [
                entry["discrepancy"] for entry in entries
            ]
        result.append(discrepancies)
    pyplot.close("all")
    return result


def _compare_pairs(
    target: _Spectrum, units: Sequence[_Spectrum], by_unit: Sequence[list[_Entry]]
) -> list[_Entry]:
    size, phase = target
    entries = []
    for unit, (unit_size, unit_phase) in enumerate(units):
        predominant = np.argmax(np.sum(size, axis=1))
        difference = (unit_phase[predominant] - phase[predominant]) % (2 * np.pi)
        difference -= 2 * np.pi * (difference > np.pi)
        entry = {
            "unit": unit,
            "discrepancy": np.linalg.norm(unit_size - size),
            "rho": 1.0 - 2.0 * abs(np.mean(difference)) / np.pi,
        }
        entries.append(entry)
        by_unit[unit].append(entry)
    return entries
