"""Speed and memory of matching: compared with a plain loop, and in a fresh process."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import get_window

from pdtui.benchmarks.optional_librosa import load_librosa
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PdtuiError
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import UnitDiscrepancies, match_units
from pdtui.spectra.matching_presets import MatchingPreset, find_matching_preset
from pdtui.spectra.phase_correlation import correlate_phases

_ROUNDING = 1e-11
"""Discrepancies closer than this share of the largest are ties: rounding decides their order."""
_STATUS = Path("/proc/self/status")


@dataclass(frozen=True)
class MatchingSpeedup:
    """Matching compared with `match_by_loop`, for one preset.

    Attributes:
        ours_ms, loop_ms: median time over rounds, ms.
        ratio: median over rounds of the loop's time over ours.
        same_ranking: whether both rank the units of every attribute alike.
        ties: neighbors in a ranking with equal discrepancy, whose order means nothing.
        largest_difference: largest difference of a discrepancy, as a share of the largest discrepancy.
    """

    preset: str
    ours_ms: float
    loop_ms: float
    ratio: float
    same_ranking: bool
    ties: int
    largest_difference: float


def compare_matching(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], preset: MatchingPreset, rounds: int
) -> MatchingSpeedup:
    """Time our matching and the loop in turn on the same data; the first call of each does not count."""
    found = match_units(episodes, attributes, preset)
    reference = match_by_loop(episodes, attributes, preset)
    ours, loops = [], []
    for _ in range(rounds):
        ours.append(time_call_in_seconds(lambda: match_units(episodes, attributes, preset)))
        loops.append(time_call_in_seconds(lambda: match_by_loop(episodes, attributes, preset)))
    same, ties = same_ranking(found, reference)
    return MatchingSpeedup(
        preset=preset.name,
        ours_ms=float(np.median(ours)) * 1e3,
        loop_ms=float(np.median(loops)) * 1e3,
        ratio=float(np.median(np.array(loops) / np.array(ours))),
        same_ranking=same,
        ties=ties,
        largest_difference=float(np.max(np.abs(found.discrepancy - reference) / reference.max())),
    )


def same_ranking(found: UnitDiscrepancies, reference: Floats) -> tuple[bool, int]:
    """Return whether both rank the units of every attribute alike, and the number of tied neighbors.

    Neighbors are tied where their discrepancies differ by less than rounding.
    """
    same, ties = True, 0
    for row, distances in enumerate(reference):
        ours = found.ranked_units(row)
        in_our_order = distances[ours]
        rounding = _ROUNDING * distances.max()
        ties += int((np.diff(np.sort(distances)) <= rounding).sum())
        same &= len(ours) == len(distances) and bool((np.diff(in_our_order) >= -rounding).all())
    return same, ties


def time_call_in_seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def match_by_loop(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], preset: MatchingPreset
) -> Floats:
    """Compute discrepancies, shape (J, U), by a `librosa.stft` per series and a `numpy.linalg.norm` per pair.

    Window, length and hop are those of the preset, without padding (``center=False``), in double precision.
    Each series is transformed once per episode, not once per pair. librosa does not divide by the sum of the
    window; that is done at the end, so that the numbers can be compared.
    """
    librosa = load_librosa()
    exponent = 2 if preset.spectrogram == "power" else 1
    window = {"rectangular": "boxcar"}.get(preset.window, preset.window)

    def spectrogram(series: Floats) -> Floats:
        stft = librosa.stft(series, n_fft=preset.length, hop_length=preset.hop, window=window, center=False)
        return np.asarray(np.abs(stft) ** exponent)

    total = np.zeros((len(attributes), episodes[0].activations.shape[1]))
    for episode in episodes:
        targets = [
            spectrogram(attribute.as_observed(episode.attributes[:, column]))
            for column, attribute in enumerate(attributes)
        ]
        for unit in range(total.shape[1]):
            one = spectrogram(episode.activations[:, unit].astype(np.float64))
            for row, target in enumerate(targets):
                total[row, unit] += np.linalg.norm(one - target)
    factor = float(get_window(window, preset.length).sum()) ** exponent
    return total / (len(episodes) * factor)


def measure_matching_memory(units: int, steps: int, attributes: int) -> tuple[float, float]:
    """Return the peak resident memory in GB and the time in s of matching and correlating.

    Both run in a fresh process, so that nothing else counts.

    Raises:
        PdtuiError: the system has no ``/proc``.
    """
    if not _STATUS.exists():
        raise PdtuiError("the memory benchmark reads /proc, which this system does not have")
    with WorkerProcess("memory of matching", int) as worker:
        worker.send(_match_many, units, steps, attributes)
        measured: tuple[float, float] = worker.receive()
    return measured


def _match_many(_: object, units: int, steps: int, attributes: int) -> tuple[float, float]:
    """Match and correlate a synthetic episode of random walks; only that is timed."""
    rng = np.random.default_rng(0)
    activations = np.empty((steps, units), np.float32)
    level = np.zeros(units, np.float32)
    for row in activations:
        level += 0.1 * rng.standard_normal(units, np.float32)
        np.tanh(level, out=row)
    episode = MonitoredEpisode(0, activations, rng.standard_normal((steps, attributes)).cumsum(axis=0))
    known = tuple(Attribute(str(column), "", scale=0.1) for column in range(attributes))
    preset = find_matching_preset("paper")
    start = time.perf_counter()
    match_units([episode], known, preset)
    correlate_phases([episode], known, preset)
    seconds = time.perf_counter() - start
    (peak,) = [line.split()[1] for line in _STATUS.read_text().splitlines() if line.startswith("VmHWM")]
    return int(peak) * 1024 / 1e9, seconds
