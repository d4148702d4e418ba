"""`pdtui bench dissect`: what matching and probing cost, measured side by side in one run."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.benchmarks.librosa_matching import load_librosa, match_by_loop
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PdtuiError
from pdtui.core.units import Stimulation
from pdtui.core.worker_pool import WorkerProcess
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.stimulated_rollout import RolloutJob
from pdtui.spectra.matching import Discrepancies, match_units
from pdtui.spectra.matching_presets import MatchingPreset, find_preset
from pdtui.spectra.monitor import MonitoredEpisode, monitor_episodes
from pdtui.spectra.phase_correlation import correlate_phases

Progress = Callable[[int, int, str], None]
_SHIFT = 37
"""Steps by which a repeated column is shifted: no multiple of a hop, so that it is another series."""
_ROUNDING = 1e-11
_STATUS = Path("/proc/self/status")


@dataclass(frozen=True)
class BenchmarkSizes:
    """How much is measured.

    Attributes:
        episodes, steps, units, attributes: of the recorded data.
        rounds: of every comparison; the two sides take turns.
        factors: of the curves: units, attributes and episodes times these.
        memory_units, memory_steps: of the synthetic episode whose memory is measured.
        probes: stimulated roll-outs a round, `probe_steps` control steps each.
    """

    episodes: int = 5
    steps: int = 1000
    units: int = 512
    attributes: int = 20
    rounds: int = 7
    factors: tuple[float, ...] = (0.25, 0.5, 1, 2, 4)
    memory_units: int = 100_000
    memory_steps: int = 1000
    probes: int = 240
    probe_steps: int = 60


@dataclass(frozen=True)
class MatchingComparison:
    """Matching against the loop, for one preset.

    Attributes:
        preset: by name.
        ours_ms, loop_ms: medians over rounds.
        ratio: median over rounds of loop / ours.
        same_ranking: whether all units of all attributes stand in the same order.
        ties: neighbours in a ranking of equal discrepancy, which may stand either way round.
        largest_difference: of a discrepancy, in parts of the largest.
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
    """How time grows in one size.

    Attributes:
        grows: which size.
        sizes: of it.
        ms: medians over rounds.
        fixed_ms, each_ms: the straight line through them, of least relative error: ms = fixed + each · size.
        deviation: largest distance from that line, in parts of it.
    """

    grows: str
    sizes: tuple[int, ...]
    ms: tuple[float, ...]
    fixed_ms: float
    each_ms: float
    deviation: float


@dataclass(frozen=True)
class DissectionBenchmark:
    """What was measured.

    Attributes:
        recorded: the data, in words.
        compared: one for each preset.
        curves: units, attributes, episodes.
        memory_units: units whose episode was matched and correlated in a fresh process.
        memory_data_gb: that its recorded activations take.
        memory_peak_gb: largest resident memory of that process, data included.
        memory_seconds: that it took.
        probing_one, probing_two: stimulated control steps a second with one and with two workers.
        probing_ratio: median over rounds of two / one.
    """

    recorded: str
    compared: tuple[MatchingComparison, ...]
    curves: tuple[ScalingCurve, ...]
    memory_units: int
    memory_data_gb: float
    memory_peak_gb: float
    memory_seconds: float
    probing_one: float
    probing_two: float
    probing_ratio: float


def bench_dissection(
    robot: str, policy: str, sizes: BenchmarkSizes | None = None, progress: Progress | None = None
) -> DissectionBenchmark:
    """Record once, then measure: against the loop, growth, memory, and probing with one and two workers.

    Raises:
        PdtuiError: librosa is missing, robot or policy cannot be had, or an episode is too short.
    """
    plan = sizes or BenchmarkSizes()
    librosa = load_librosa()

    def stage(done: int, name: str) -> None:
        if progress is not None:
            progress(done, 5, name)

    with RolloutPool(robot, policy, 1) as one, RolloutPool(robot, policy, 2) as two:
        stage(0, "record")
        episodes, attributes = record_episodes(one, plan)
        stage(1, "compare with the loop")
        compared = tuple(
            compare_matching(librosa, episodes, attributes, find_preset(name), plan.rounds)
            for name in ("paper", "authors")
        )
        stage(2, "growth")
        curves = matching_time_by_size(episodes, attributes, find_preset("paper"), plan)
        stage(3, "memory")
        peak, seconds = matching_memory(plan.memory_units, plan.memory_steps, len(attributes))
        stage(4, "probing")
        rates = probing_rate(one, two, plan)
        words = (
            f"{plan.episodes} episodes of {plan.steps} steps of {robot}; {one.policy.units} units and "
            f"{len(one.robot.attributes)} attributes recorded, {plan.units} and {plan.attributes} used"
        )
        if plan.units > one.policy.units or plan.attributes > len(one.robot.attributes):
            words += "; columns beyond those are recorded ones, shifted in time"
    stage(5, "done")
    return DissectionBenchmark(
        recorded=words,
        compared=compared,
        curves=curves,
        memory_units=plan.memory_units,
        memory_data_gb=plan.memory_units * plan.memory_steps * 4 / 1e9,
        memory_peak_gb=peak,
        memory_seconds=seconds,
        probing_one=float(np.median(rates[:, 0])),
        probing_two=float(np.median(rates[:, 1])),
        probing_ratio=float(np.median(rates[:, 1] / rates[:, 0])),
    )


def record_episodes(
    pool: RolloutPool, plan: BenchmarkSizes
) -> tuple[list[MonitoredEpisode], tuple[Attribute, ...]]:
    """Unstimulated episodes, with as many columns as asked for.

    Raises:
        PdtuiError: an episode ended early: the sizes would not be those that are reported.
    """
    recorded = monitor_episodes(pool.robot, pool.policy, range(1000, 1000 + plan.episodes), plan.steps)
    for episode in recorded:
        if episode.steps < plan.steps:
            raise PdtuiError(
                f"{pool.robot.name}: expected {plan.steps} steps, but the episode of seed {episode.seed} "
                f"ended after {episode.steps}: {episode.ended}"
            )
    episodes = [widen_episode(episode, plan.units, plan.attributes) for episode in recorded]
    known = pool.robot.attributes
    attributes = tuple(
        replace(known[column % len(known)], name=f"{known[column % len(known)].name} {column}")
        for column in range(plan.attributes)
    )
    return episodes, attributes


def widen_episode(episode: MonitoredEpisode, units: int, attributes: int) -> MonitoredEpisode:
    """An episode of other widths: columns beyond the recorded ones repeat them, shifted in time."""
    return replace(
        episode,
        activations=_widened(episode.activations, units),
        attributes=_widened(episode.attributes, attributes),
    )


def _widened(series: NDArray[Any], width: int) -> NDArray[Any]:
    copies = -(-width // series.shape[1])
    shifted = [np.roll(series, _SHIFT * copy, axis=0) for copy in range(copies)]
    return np.ascontiguousarray(np.hstack(shifted)[:, :width])


def compare_matching(
    librosa: Any,
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    rounds: int,
) -> MatchingComparison:
    """Ours and the loop in turn on the same data; the first call of each is not counted."""
    found = match_units(episodes, attributes, preset)
    reference = match_by_loop(librosa, episodes, attributes, preset)
    ours, loops = [], []
    for _ in range(rounds):
        ours.append(_seconds(lambda: match_units(episodes, attributes, preset)))
        loops.append(_seconds(lambda: match_by_loop(librosa, episodes, attributes, preset)))
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
    """Whether both order all units of every attribute alike, and how many neighbours are tied.

    Tied are neighbours whose discrepancies differ by less than rounding: which comes first means nothing.
    """
    same, ties = True, 0
    for row, distances in enumerate(reference):
        ours = found.ranked_units(row)
        in_our_order = distances[ours]
        rounding = _ROUNDING * distances.max()
        ties += int((np.diff(np.sort(distances)) <= rounding).sum())
        same &= len(ours) == len(distances) and bool((np.diff(in_our_order) >= -rounding).all())
    return same, ties


def matching_time_by_size(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    plan: BenchmarkSizes,
) -> tuple[ScalingCurve, ...]:
    """Time of matching while one size grows and the others stay."""

    def sized(units: int, columns: int, count: int) -> Callable[[], Discrepancies]:
        data = [widen_episode(episodes[number % len(episodes)], units, columns) for number in range(count)]
        chosen = [attributes[column % len(attributes)] for column in range(columns)]
        return lambda: match_units(data, chosen, preset)

    full = {"units": plan.units, "attributes": plan.attributes, "episodes": plan.episodes}
    curves = []
    for grows, size in full.items():
        sizes = sorted({max(1, round(size * factor)) for factor in plan.factors})
        cases = [sized(*{**full, grows: one}.values()) for one in sizes]
        rounds = [[_seconds(case) for case in cases] for _ in range(plan.rounds)]
        times = np.median(rounds, axis=0) * 1e3
        each, fixed = np.polyfit(sizes, times, 1, w=1 / times)
        line = fixed + each * np.array(sizes)
        deviation = float(np.max(np.abs(times / line - 1)))
        curves.append(
            ScalingCurve(grows, tuple(sizes), tuple(times.tolist()), float(fixed), float(each), deviation)
        )
    return tuple(curves)


def matching_memory(units: int, steps: int, attributes: int) -> tuple[float, float]:
    """Largest resident memory in GB, and seconds, of matching and correlating in a fresh process.

    Raises:
        PdtuiError: there is no ``/proc`` here to read a process's memory from.
    """
    if not _STATUS.exists():
        raise PdtuiError("the benchmark of memory reads /proc, which this system does not have")
    with WorkerProcess("memory of matching", int) as worker:
        worker.send(_match_many, units, steps, attributes)
        seconds: tuple[float, float] = worker.receive()
    return seconds


def _match_many(_: object, units: int, steps: int, attributes: int) -> tuple[float, float]:
    """One synthetic episode of random walks; seconds are those of matching and correlating alone."""
    rng = np.random.default_rng(0)
    activations = np.empty((steps, units), np.float32)
    level = np.zeros(units, np.float32)
    for row in activations:
        level += 0.1 * rng.standard_normal(units, np.float32)
        np.tanh(level, out=row)
    episode = MonitoredEpisode(0, activations, rng.standard_normal((steps, attributes)).cumsum(axis=0))
    known = tuple(Attribute(str(column), "", scale=0.1) for column in range(attributes))
    preset = find_preset("paper")
    start = time.perf_counter()
    match_units([episode], known, preset)
    correlate_phases([episode], known, preset)
    seconds = time.perf_counter() - start
    (peak,) = [line.split()[1] for line in _STATUS.read_text().splitlines() if line.startswith("VmHWM")]
    return int(peak) * 1024 / 1e9, seconds


def probing_rate(one: RolloutPool, two: RolloutPool, plan: BenchmarkSizes) -> Floats:
    """Stimulated control steps a second with one and two workers, in turn; shape (rounds, 2)."""
    rng = np.random.default_rng(0)
    starts = collect_start_states(one.robot, one.policy, 1100, 2, at=50, survive=plan.probe_steps)
    jobs: list[RolloutJob] = [
        (Stimulation((int(rng.integers(one.policy.units)),), (float(rng.normal(0, 3)),)), number % 2)
        for number in range(plan.probes)
    ]
    two.run(jobs, starts, 1, 0)  # the worker processes start

    def rate(pool: RolloutPool) -> float:
        before = pool.steps_run
        seconds = _seconds(lambda: pool.run(jobs, starts, plan.probe_steps, 0))
        return (pool.steps_run - before) / seconds

    return np.array([[rate(one), rate(two)] for _ in range(plan.rounds)])


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
