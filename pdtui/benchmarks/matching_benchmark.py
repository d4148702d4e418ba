"""Speed of matching: compared with a plain loop, and as each size grows."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdtui.benchmarks.benchmark_episodes import DissectionBenchmarkSettings, widen_episode
from pdtui.benchmarks.librosa_matching import match_by_loop
from pdtui.core.attributes import Attribute, Floats
from pdtui.spectra.matching import Discrepancies, match_units
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.monitor import MonitoredEpisode

_ROUNDING = 1e-11
"""Discrepancies closer than this share of the largest are ties: rounding decides their order."""


@dataclass(frozen=True)
class MatchingComparison:
    """Matching compared with the loop of `librosa_matching`, for one preset.

    Attributes:
        preset: name of the preset.
        ours_ms, loop_ms: median time over rounds, ms.
        ratio: median over rounds of the loop's time over ours.
        same_ranking: whether both rank the units of every attribute alike.
        ties: neighbours in a ranking with equal discrepancy, whose order means nothing.
        largest_difference: largest difference of a discrepancy, as a share of the largest discrepancy.
    """

    preset: str
    ours_ms: float
    loop_ms: float
    ratio: float
    same_ranking: bool
    ties: int
    largest_difference: float


@dataclass(frozen=True)
class ScalingCurve:
    """How the time of matching grows with one size.

    Attributes:
        grows: name of the size.
        sizes: its values.
        ms: median time over rounds at each of them, ms.
        fixed_ms, each_ms: the line of least relative error, ms = fixed + each · size.
        deviation: largest relative distance from that line.
    """

    grows: str
    sizes: tuple[int, ...]
    ms: tuple[float, ...]
    fixed_ms: float
    each_ms: float
    deviation: float


def compare_matching(
    librosa: Any,
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    rounds: int,
) -> MatchingComparison:
    """Time our matching and the loop in turn on the same data; the first call of each does not count."""
    found = match_units(episodes, attributes, preset)
    reference = match_by_loop(librosa, episodes, attributes, preset)
    ours, loops = [], []
    for _ in range(rounds):
        ours.append(measure_seconds(lambda: match_units(episodes, attributes, preset)))
        loops.append(measure_seconds(lambda: match_by_loop(librosa, episodes, attributes, preset)))
    same, ties = same_ranking(found, reference)
    return MatchingComparison(
        preset=preset.name,
        ours_ms=float(np.median(ours)) * 1e3,
        loop_ms=float(np.median(loops)) * 1e3,
        ratio=float(np.median(np.array(loops) / np.array(ours))),
        same_ranking=same,
        ties=ties,
        largest_difference=float(np.max(np.abs(found.discrepancy - reference) / reference.max())),
    )


def same_ranking(found: Discrepancies, reference: Floats) -> tuple[bool, int]:
    """Return whether both rank the units of every attribute alike, and the number of tied neighbours.

    Neighbours are tied where their discrepancies differ by less than rounding.
    """
    same, ties = True, 0
    for row, distances in enumerate(reference):
        ours = found.ranked_units(row)
        in_our_order = distances[ours]
        rounding = _ROUNDING * distances.max()
        ties += int((np.diff(np.sort(distances)) <= rounding).sum())
        same &= len(ours) == len(distances) and bool((np.diff(in_our_order) >= -rounding).all())
    return same, ties


def measure_matching_growth(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    settings: DissectionBenchmarkSettings,
) -> tuple[ScalingCurve, ...]:
    """Time matching while one size grows and the others stay the same."""

    def sized(units: int, columns: int, count: int) -> Callable[[], Discrepancies]:
        data = [widen_episode(episodes[number % len(episodes)], units, columns) for number in range(count)]
        chosen = [attributes[column % len(attributes)] for column in range(columns)]
        return lambda: match_units(data, chosen, preset)

    full = {"units": settings.units, "attributes": settings.attributes, "episodes": settings.episodes}
    curves = []
    for grows, size in full.items():
        sizes = sorted({max(1, round(size * factor)) for factor in settings.factors})
        cases = [sized(*{**full, grows: one}.values()) for one in sizes]
        rounds = [[measure_seconds(case) for case in cases] for _ in range(settings.rounds)]
        times = np.median(rounds, axis=0) * 1e3
        each, fixed = np.polyfit(sizes, times, 1, w=1 / times)
        line = fixed + each * np.array(sizes)
        deviation = float(np.max(np.abs(times / line - 1)))
        curves.append(
            ScalingCurve(grows, tuple(sizes), tuple(times.tolist()), float(fixed), float(each), deviation)
        )
    return tuple(curves)


def measure_seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
