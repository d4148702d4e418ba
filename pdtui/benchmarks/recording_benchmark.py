"""`pdtui bench record` and `memory`: the cost of recording at 50 Hz, and the memory of a long drive."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import ScreenError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_recording import PACED_ROWS_PER_WRITE
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_schema import ACTIVATIONS_KEPT, ActivationsKept
from pdtui.sessions.writer.recorder_process import RecorderProcess
from pdtui.sessions.writer.session_recorder import SessionRecorder

RATE = 50.0
"""Control steps per second that are assumed, whatever the robot's own rate."""

_PRESS_EVERY, _HELD = 150, 50
_SAMPLES = 10


@dataclass(frozen=True)
class RecordingCost:
    """The cost of one way to record, in the small batches of a drive on the screen.

    Attributes:
        cpu_share: time of all threads at `RATE`, as a share of one core.
        mb_a_minute: growth of the file at `RATE`, including its end, MB per minute.
    """

    activations: ActivationsKept
    driven: str
    cpu_share: float
    mb_a_minute: float


@dataclass(frozen=True)
class RecordingBenchmark:
    """The result of `bench_record`."""

    units: int
    steps: int
    costs: tuple[RecordingCost, ...]


@dataclass(frozen=True)
class MemoryBenchmark:
    """Resident memory over a long drive without a screen.

    Attributes:
        file_bytes: size of the session, bytes.
        seconds: time of recording, examining and replaying, s.
        resident: resident memory at ten moments, bytes: of this process while the drive is recorded, of the
            process that records, and of this process while it replays.
    """

    steps: int
    file_bytes: int
    seconds: dict[str, float]
    resident: dict[str, list[int]]
    verdict: str
    whole: bool


def bench_record(
    config: DriveConfig, *, steps: int = 6000, progress: StepProgress | None = None
) -> RecordingBenchmark:
    """Record the same drives in each way; only the recorder's work is measured.

    In one drive no key is pressed; in the other each behavior is latched in turn for a third of the time.

    Raises:
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    loop = build_control_loop(config)
    drives = {"nothing is pressed": _driven(loop, config.seed, steps, ())}
    if loop.map.behaviors:
        drives["behaviors in turn"] = _driven(loop, config.seed, steps, tuple(loop.map.behaviors))
    costs = []
    for kept in ACTIVATIONS_KEPT:
        for name, records in drives.items():
            info = replace(loop.info, activations=kept, dt=1.0 / RATE)
            costs.append(RecordingCost(kept, name, *_cost(info, records)))
            if progress is not None:
                progress(len(costs), len(ACTIVATIONS_KEPT) * len(drives))
    return RecordingBenchmark(loop.policy.units, steps, tuple(costs))


def _driven(loop: ControlLoop, seed: int, steps: int, behaviors: Sequence[str]) -> list[StepRecord]:
    fresh = ControlLoop(loop.robot, loop.policy, loop.map, seed)
    return [fresh.advance(_pressed(step, behaviors)) for step in range(steps)]


def _pressed(step: int, behaviors: Sequence[str]) -> list[DriveEvent]:
    turn, within = divmod(step, _PRESS_EVERY)
    if behaviors and within == 0:
        return [DriveEvent(step, "behavior", behaviors[turn % len(behaviors)], key="x")]
    if behaviors and within == _HELD:
        return [DriveEvent(step, "default", key="x")]
    return []


def _cost(info: DriveInfo, records: Sequence[StepRecord]) -> tuple[float, float]:
    with tempfile.TemporaryDirectory() as folder:
        recorder = SessionRecorder(Path(folder) / "bench.rrd", info, rows_per_write=PACED_ROWS_PER_WRITE)
        before, size = time.process_time(), recorder.bytes
        for record in records:
            recorder.write(record)
        recorder.close("finished")
        used = time.process_time() - before
        seconds = len(records) / RATE
        return used / seconds, (recorder.bytes - size) / 1e6 / (seconds / 60)


def bench_memory(config: DriveConfig, *, steps: int, progress: StepProgress | None = None) -> MemoryBenchmark:
    """Record a long drive without a screen, examine it and replay it.

    Raises:
        ScreenError: the system has no ``/proc``.
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    if not Path("/proc/self/statm").exists():
        raise ScreenError("the memory benchmark reads /proc, which this system does not have")
    every = max(1, steps // _SAMPLES)
    resident: dict[str, list[int]] = {"recording": [], "recorder": [], "replaying": []}
    seconds: dict[str, float] = {}

    def sample(part: str, done: int, pid: int = 0) -> None:
        if done % every == 0:
            resident[part].append(_resident())
            if pid:
                resident["recorder"].append(_resident(str(pid)))
        if progress is not None:
            progress(done + (steps if part == "replaying" else 0), 2 * steps)

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.rrd"
        start = time.perf_counter()
        loop = build_control_loop(config)
        names = tuple(loop.map.behaviors)
        with RecorderProcess() as process:
            recorder = process.begin_recording(path, replace(loop.info, activations=config.activations))
            for step in range(steps):
                recorder.write(loop.advance(_pressed(step, names)))
                sample("recording", step + 1, process.pid)
            recorder.close("finished")
        seconds["recording"] = time.perf_counter() - start
        start = time.perf_counter()
        whole = examine_session(path).whole
        seconds["examining"] = time.perf_counter() - start
        start = time.perf_counter()
        result = replay_session(path, progress=lambda done, _: sample("replaying", done))
        seconds["replaying"] = time.perf_counter() - start
        return MemoryBenchmark(steps, path.stat().st_size, seconds, resident, result.verdict, whole)


def _resident(process: str = "self") -> int:
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
