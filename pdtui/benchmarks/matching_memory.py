"""Peak memory of matching, measured in a fresh process."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from pdtui.core.attributes import Attribute
from pdtui.core.errors import PdtuiError
from pdtui.core.worker_pool import WorkerProcess
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_preset
from pdtui.spectra.monitor import MonitoredEpisode
from pdtui.spectra.phase_correlation import correlate_phases

_STATUS = Path("/proc/self/status")


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
    preset = find_preset("paper")
    start = time.perf_counter()
    match_units([episode], known, preset)
    correlate_phases([episode], known, preset)
    seconds = time.perf_counter() - start
    (peak,) = [line.split()[1] for line in _STATUS.read_text().splitlines() if line.startswith("VmHWM")]
    return int(peak) * 1024 / 1e9, seconds
