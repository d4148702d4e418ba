"""`pdtui bench loop`: the cost of each part of a control step, measured side by side in one run."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdtui.benchmarks.matching_benchmark import time_call_in_seconds
from pdtui.core.drive_events import DriveEvent
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.sessions.writer.recorder_process import RecorderProcess
from pdtui.stimulation.interventions.unit_edits import AddToUnits, ImprintUnits

ROUNDS = 7
_EDITED_UNITS = 64


@dataclass(frozen=True)
class ControlLoopBenchmark:
    """Medians over rounds.

    Attributes:
        bare: control steps per second of the simulator alone.
        policy: the same with the policy.
        stimulated: the same of the whole control loop, with attributes and stimulation.
        recorded: the same with a recorder, until its process has completed the file.
        recorded_share: median over rounds of `recorded` over `bare`.
        forward_us: time of a forward pass with three stimulated units, µs.
        added_us: the same with something added to 64 units, µs.
        imprinted_us: the same with an imprint of 64 units, which takes a second pass, µs.
    """

    bare: float
    policy: float
    stimulated: float
    recorded: float
    recorded_share: float
    forward_us: float
    added_us: float
    imprinted_us: float


def bench_loop(
    config: DriveConfig, *, steps: int = 5000, rounds: int = ROUNDS, progress: StepProgress | None = None
) -> ControlLoopBenchmark:
    """Measure the four in turn over several rounds, so that a drifting machine affects all alike.

    The robot walks in all four: the bare simulator gets the actions that the policy chose from the same
    start.

    Raises:
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    loop = build_control_loop(config)
    walked = _actions(loop, config.seed, steps)
    behavior = next(iter(config.stimulation_map.behaviors), "")
    parts: dict[str, Callable[[], float]] = {
        "bare": lambda: _bare(loop, config.seed, walked),
        "policy": lambda: steps / time_call_in_seconds(lambda: _actions(loop, config.seed, steps)),
        "stimulated": lambda: _whole(loop, config.seed, steps, behavior, recorded=False),
        "recorded": lambda: _whole(loop, config.seed, steps, behavior, recorded=True),
    }
    rates: dict[str, list[float]] = {name: [] for name in parts}
    for done in range(rounds):
        for name, measure in parts.items():
            rates[name].append(measure())
        if progress is not None:
            progress(done + 1, rounds)
    share = float(np.median(np.array(rates["recorded"]) / np.array(rates["bare"])))
    medians = {name: float(np.median(values)) for name, values in rates.items()}
    width = loop.policy.units
    units = np.arange(min(_EDITED_UNITS, loop.policy.layers[0]))
    return ControlLoopBenchmark(
        **medians,
        recorded_share=share,
        forward_us=_forward_us(loop, Stimulation((0, width // 2, width - 1), (1.0, -1.0, 2.0))),
        added_us=_forward_us(loop, Stimulation(edits=(AddToUnits(units, np.full(len(units), 0.1)),))),
        imprinted_us=_forward_us(loop, Stimulation(edits=(ImprintUnits(units, np.negative),))),
    )


def _actions(loop: ControlLoop, seed: int, steps: int) -> list[np.ndarray]:
    observation, _ = loop.robot.reset(seed=seed)
    loop.policy.reset()
    actions = []
    for _ in range(steps):
        actions.append(loop.policy.act(observation).action)
        observation, _, terminated, truncated, _ = loop.robot.step(actions[-1])
        if terminated or truncated:
            observation, _ = loop.robot.reset()
            loop.policy.reset()
    return actions


def _bare(loop: ControlLoop, seed: int, actions: list[np.ndarray]) -> float:
    loop.robot.reset(seed=seed)
    start = time.perf_counter()
    for action in actions:
        _, _, terminated, truncated, _ = loop.robot.step(action)
        if terminated or truncated:
            loop.robot.reset()
    return len(actions) / (time.perf_counter() - start)


def _whole(loop: ControlLoop, seed: int, steps: int, behavior: str, *, recorded: bool) -> float:
    fresh = ControlLoop(loop.robot, loop.policy, loop.map, seed)
    with tempfile.TemporaryDirectory() as folder, RecorderProcess(soon=False) as process:
        recorder = process.begin_recording(Path(folder) / "bench.rrd", loop.info) if recorded else None
        start = time.perf_counter()
        for step in range(steps):
            events = [DriveEvent(step, "behavior", behavior)] if behavior and step % 200 == 100 else []
            if step % 200 == 150:
                events = [DriveEvent(step, "default")]
            record = fresh.advance(events)
            if recorder is not None:
                recorder.write(record)
        if recorder is not None:
            recorder.close("finished")
        return steps / (time.perf_counter() - start)


def _forward_us(loop: ControlLoop, stimulation: Stimulation, calls: int = 2000) -> float:
    observation = loop.robot.observe()
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        for _ in range(calls):
            loop.policy.act(observation, stimulation)
        times.append((time.perf_counter() - start) / calls * 1e6)
    return float(np.median(times))
