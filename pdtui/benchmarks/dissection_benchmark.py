"""`pdtui bench dissect`: the cost of matching and probing, measured side by side in one run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.benchmarks.matching_benchmark import (
    MatchingSpeedup,
    compare_matching,
    measure_matching_memory,
    time_call_in_seconds,
)
from pdtui.benchmarks.optional_librosa import load_librosa
from pdtui.benchmarks.random_rollouts import draw_rollout_jobs
from pdtui.benchmarks.released_procedure import ReleasedProcedureSpeedup, compare_with_released_procedure
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PdtuiError
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.robots import RobotSpec
from pdtui.spectra.episode_monitor import MonitoredEpisode, monitor_episodes
from pdtui.spectra.matching import UnitDiscrepancies, match_units
from pdtui.spectra.matching_presets import MatchingPreset, find_matching_preset

Progress = Callable[[int, int, str], None]


_SHIFT = 37
"""Control steps by which a repeated column is shifted; no multiple of a hop, so that the series differ."""


@dataclass(frozen=True)
class DissectionBenchmarkSettings:
    """How much the dissection benchmark measures.

    Attributes:
        episodes, steps, units, attributes: size of the recorded data; steps per episode.
        rounds: rounds of each comparison, in which both sides take turns.
        factors: each size is multiplied by these to see how time grows with it.
        memory_units, memory_steps: size of the synthetic episode whose memory is measured.
        probes: stimulated roll-outs per round.
        probe_steps: control steps per roll-out.
    """

    episodes: int = 5
    steps: int = 1000
    units: int = 512
    attributes: int = 16
    rounds: int = 7
    factors: tuple[float, ...] = (0.25, 0.5, 1, 2, 4)
    memory_units: int = 100_000
    memory_steps: int = 1000
    probes: int = 240
    probe_steps: int = 60


@dataclass(frozen=True)
class MatchingTimeCurve:
    """How the time of matching grows with one size.

    Attributes:
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


@dataclass(frozen=True)
class DissectionBenchmark:
    """The result of `bench_dissection`.

    Attributes:
        compared: matching against the loop, per preset.
        released: matching against the procedure of the authors' released code.
        curves: time of matching by number of units, attributes and episodes.
        memory_units: number of units of the episode that was matched and correlated in a fresh process.
        memory_data_gb: size of its activations, GB.
        memory_peak_gb: peak resident memory of that process, including the data, GB.
        memory_seconds: time that matching and correlating took there, s.
        probing_one, probing_two: stimulated control steps per second with one worker and with two.
        probing_ratio: median over rounds of the two workers' rate over the one worker's.
    """

    recorded: str
    compared: tuple[MatchingSpeedup, ...]
    released: ReleasedProcedureSpeedup
    curves: tuple[MatchingTimeCurve, ...]
    memory_units: int
    memory_data_gb: float
    memory_peak_gb: float
    memory_seconds: float
    probing_one: float
    probing_two: float
    probing_ratio: float


def bench_dissection(
    robot: str | RobotSpec,
    policy: str,
    settings: DissectionBenchmarkSettings,
    progress: Progress | None = None,
) -> DissectionBenchmark:
    """Record episodes, then measure matching, its growth and memory, and probing with one and two workers.

    Raises:
        PdtuiError: librosa is missing, the robot or policy cannot be loaded, or an episode is too short.
    """
    load_librosa()

    def stage(done: int, name: str) -> None:
        if progress is not None:
            progress(done, 6, name)

    with RolloutPool(robot, policy, 1) as one, RolloutPool(robot, policy, 2) as two:
        stage(0, "record")
        episodes, attributes = record_episodes(one, settings)
        stage(1, "compare with the loop")
        compared = tuple(
            compare_matching(episodes, attributes, find_matching_preset(name), settings.rounds)
            for name in ("paper", "authors")
        )
        stage(2, "compare with the released procedure")
        released = compare_with_released_procedure(episodes, attributes, settings.rounds)
        stage(3, "growth")
        curves = measure_matching_growth(episodes, attributes, find_matching_preset("paper"), settings)
        stage(4, "memory")
        peak, seconds = measure_matching_memory(settings.memory_units, settings.memory_steps, len(attributes))
        stage(5, "probing")
        rates = measure_probing_rate(one, two, settings)
        words = (
            f"{robot}, {settings.episodes} episodes of {settings.steps} steps: {one.policy.units} units and "
            f"{len(one.robot.attributes)} attributes, of which {settings.units} and {settings.attributes} "
            "are used"
        )
        if settings.units > one.policy.units or settings.attributes > len(one.robot.attributes):
            words += "; the others are recorded ones, shifted in time"
    stage(6, "done")
    return DissectionBenchmark(
        recorded=words,
        compared=compared,
        released=released,
        curves=curves,
        memory_units=settings.memory_units,
        memory_data_gb=settings.memory_units * settings.memory_steps * 4 / 1e9,
        memory_peak_gb=peak,
        memory_seconds=seconds,
        probing_one=float(np.median(rates[:, 0])),
        probing_two=float(np.median(rates[:, 1])),
        probing_ratio=float(np.median(rates[:, 1] / rates[:, 0])),
    )


def measure_probing_rate(one: RolloutPool, two: RolloutPool, settings: DissectionBenchmarkSettings) -> Floats:
    """Return stimulated control steps per second with one and two workers, in turn, shape (rounds, 2)."""
    starts = collect_start_states(one.robot, one.policy, 1100, 2, at=50)
    jobs = draw_rollout_jobs(settings.probes, one.policy.units, len(starts))
    two.run(jobs, starts, 1, 0)  # start the worker processes before the clock

    def rate(pool: RolloutPool) -> float:
        before = pool.control_steps
        seconds = time_call_in_seconds(lambda: pool.run(jobs, starts, settings.probe_steps, 0))
        return (pool.control_steps - before) / seconds

    return np.array([[rate(one), rate(two)] for _ in range(settings.rounds)])


def record_episodes(
    pool: RolloutPool, settings: DissectionBenchmarkSettings
) -> tuple[list[MonitoredEpisode], tuple[Attribute, ...]]:
    """Record episodes without stimulation, widened to the numbers of units and attributes of the settings.

    Raises:
        PdtuiError: an episode ended before its number of steps.
    """
    walks = monitor_episodes(pool.robot, pool.policy, range(1000, 1000 + settings.episodes), settings.steps)
    for episode in walks:
        if episode.steps < settings.steps:
            raise PdtuiError(
                f"{pool.robot.name}: expected {settings.steps} steps, but the episode of seed {episode.seed} "
                f"ended after {episode.steps}: {episode.ended}"
            )
    episodes = [widen_episode_columns(episode, settings.units, settings.attributes) for episode in walks]
    known = pool.robot.attributes
    attributes = tuple(
        replace(known[column % len(known)], name=f"{known[column % len(known)].name} {column}")
        for column in range(settings.attributes)
    )
    return episodes, attributes


def widen_episode_columns(episode: MonitoredEpisode, units: int, attributes: int) -> MonitoredEpisode:
    """Return the episode with other widths; columns beyond the recorded ones repeat them, shifted in time."""
    return replace(
        episode,
        activations=_widened(episode.activations, units),
        attributes=_widened(episode.attributes, attributes),
    )


def _widened(series: NDArray[Any], width: int) -> NDArray[Any]:
    copies = -(-width // series.shape[1])
    shifted = [np.roll(series, _SHIFT * copy, axis=0) for copy in range(copies)]
    return np.ascontiguousarray(np.hstack(shifted)[:, :width])


def measure_matching_growth(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
    settings: DissectionBenchmarkSettings,
) -> tuple[MatchingTimeCurve, ...]:
    """Time matching while one size grows and the others stay the same."""

    def sized(units: int, columns: int, count: int) -> Callable[[], UnitDiscrepancies]:
        data = [
            widen_episode_columns(episodes[number % len(episodes)], units, columns) for number in range(count)
        ]
        chosen = [attributes[column % len(attributes)] for column in range(columns)]
        return lambda: match_units(data, chosen, preset)

    full = {"units": settings.units, "attributes": settings.attributes, "episodes": settings.episodes}
    curves = []
    for grows, size in full.items():
        sizes = sorted({max(1, round(size * factor)) for factor in settings.factors})
        cases = [sized(*{**full, grows: one}.values()) for one in sizes]
        rounds = [[time_call_in_seconds(case) for case in cases] for _ in range(settings.rounds)]
        times = np.median(rounds, axis=0) * 1e3
        each, fixed = np.polyfit(sizes, times, 1, w=1 / times).tolist()
        line = fixed + each * np.array(sizes)
        deviation = float(np.max(np.abs(times / line - 1)))
        curves.append(MatchingTimeCurve(grows, tuple(sizes), tuple(times.tolist()), fixed, each, deviation))
    return tuple(curves)
