"""`pdtui bench dissect`: the cost of matching and probing, measured side by side in one run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pdtui.benchmarks.benchmark_episodes import DissectionBenchmarkSettings, record_episodes
from pdtui.benchmarks.matching_benchmark import (
    MatchingComparison,
    ScalingCurve,
    compare_matching,
    load_librosa,
    measure_matching_growth,
    measure_matching_memory,
    measure_seconds,
)
from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.stimulated_rollout import RolloutJob
from pdtui.spectra.matching_presets import find_preset

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class DissectionBenchmark:
    """The result of `bench_dissection`.

    Attributes:
        recorded: description of the data.
        compared: matching against the loop, per preset.
        curves: time of matching by number of units, attributes and episodes.
        memory_units: number of units of the episode that was matched and correlated in a fresh process.
        memory_data_gb: size of its activations, GB.
        memory_peak_gb: peak resident memory of that process, including the data, GB.
        memory_seconds: time that matching and correlating took there, s.
        probing_one, probing_two: stimulated control steps per second with one worker and with two.
        probing_ratio: median over rounds of the two workers' rate over the one worker's.
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
    robot: str, policy: str, settings: DissectionBenchmarkSettings, progress: Progress | None = None
) -> DissectionBenchmark:
    """Record episodes, then measure matching, its growth and memory, and probing with one and two workers.

    Raises:
        PdtuiError: librosa is missing, the robot or policy cannot be loaded, or an episode is too short.
    """
    load_librosa()

    def stage(done: int, name: str) -> None:
        if progress is not None:
            progress(done, 5, name)

    with RolloutPool(robot, policy, 1) as one, RolloutPool(robot, policy, 2) as two:
        stage(0, "record")
        episodes, attributes = record_episodes(one, settings)
        stage(1, "compare with the loop")
        compared = tuple(
            compare_matching(episodes, attributes, find_preset(name), settings.rounds)
            for name in ("paper", "authors")
        )
        stage(2, "growth")
        curves = measure_matching_growth(episodes, attributes, find_preset("paper"), settings)
        stage(3, "memory")
        peak, seconds = measure_matching_memory(settings.memory_units, settings.memory_steps, len(attributes))
        stage(4, "probing")
        rates = measure_probing_rate(one, two, settings)
        words = (
            f"{robot}, {settings.episodes} episodes of {settings.steps} steps: {one.policy.units} units and "
            f"{len(one.robot.attributes)} attributes, of which {settings.units} and {settings.attributes} "
            "are used"
        )
        if settings.units > one.policy.units or settings.attributes > len(one.robot.attributes):
            words += "; the others are recorded ones, shifted in time"
    stage(5, "done")
    return DissectionBenchmark(
        recorded=words,
        compared=compared,
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
    rng = np.random.default_rng(0)
    starts = collect_start_states(one.robot, one.policy, 1100, 2, at=50, survive=settings.probe_steps)
    jobs: list[RolloutJob] = [
        (Stimulation((int(rng.integers(one.policy.units)),), (float(rng.normal(0, 3)),)), number % 2)
        for number in range(settings.probes)
    ]
    two.run(jobs, starts, 1, 0)  # start the worker processes before the clock

    def rate(pool: RolloutPool) -> float:
        before = pool.control_steps
        seconds = measure_seconds(lambda: pool.run(jobs, starts, settings.probe_steps, 0))
        return (pool.control_steps - before) / seconds

    return np.array([[rate(one), rate(two)] for _ in range(settings.rounds)])
