"""Tuning beside a drive, in a process of its own: what `pdtui tune` does, with a bound on its time.

The screen's process imports this module, so neither PyTorch nor a simulator may come with it.
"""

from __future__ import annotations

import multiprocessing
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Literal

from pdtui.core.closable import Closable
from pdtui.core.processes.background_worker import BackgroundWorker
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.stimulation.stimulation_map import PidGains

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig

TUNING_SEEDS = range(2000, 2010)
"""Seeds of the drives: half for the search, half to compare what it found."""
TUNING_MINUTES = 1.5
"""Time of the search, which the comparison follows."""
_POINTS, _REFINEMENTS = 10, 8
TuningCondition = Literal["loading", "tuning", "done", "failed"]


@dataclass(frozen=True)
class OfferedGains:
    """A controller that was compared with the others, on seeds that no search saw.

    Attributes:
        origin: ``map``, ``proportional`` or ``found``.
        pid: the controller.
        error: its mean |error|, in the attribute's unit.
        failures, drives: drives in which the robot failed, and all drives.
    """

    origin: str
    pid: PidGains
    error: float
    failures: int
    drives: int


@dataclass(frozen=True)
class GainTuningState:
    """How a tuning stands.

    Attributes:
        condition: ``loading`` robot and policy; ``tuning``; ``done``; ``failed``.
        behavior: name of the behavior.
        message: why there is no tuning, or its result in a sentence.
        tried, total: controllers tried, and the most that will be.
        offered: the controllers that were compared, the best first.
    """

    condition: TuningCondition
    behavior: str
    message: str = ""
    tried: int = 0
    total: int = 0
    offered: tuple[OfferedGains, ...] = ()


class GainTuningProcess(Closable):
    """Tunes behaviors of a drive's map in a worker process, which is kept for later ones.

    Args:
        config: the drive.
        minutes: time of a search.
    """

    def __init__(self, config: DriveConfig, minutes: float = TUNING_MINUTES) -> None:
        config = replace(config, recording="", viewer=None, watched=None, ghost=None)
        self._progress, theirs = multiprocessing.get_context("spawn").Pipe(duplex=False)
        self._worker = BackgroundWorker("the tuning", _TuningJobs, config, theirs)
        self._minutes = minutes
        self.state: GainTuningState | None = None
        """How the present tuning stands; None before the first."""

    def tune(self, behavior: str) -> str:
        """Begin to tune a behavior, unless a tuning is under way; return a notice for the user."""
        if self._worker.is_busy:
            return "a tuning is under way; it ends by itself"
        self.state = GainTuningState("loading", behavior)
        self._worker.submit(
            lambda worker: self._tune(worker, behavior),
            lambda said: self._note(GainTuningState("failed", behavior, f"no tuning: {said}")),
        )
        return ""

    def close(self) -> None:
        """Kill the process."""
        self._worker.close()

    def _note(self, state: GainTuningState) -> None:
        self.state = state

    def _tune(self, worker: WorkerProcess, behavior: str) -> None:
        while self._progress.poll():  # what an earlier tuning said last
            self._progress.recv()
        worker.send(_TuningJobs.run, behavior, self._minutes)
        while worker.connection not in wait([worker.connection, self._progress]):
            tried, total = self._progress.recv()
            self._note(GainTuningState("tuning", behavior, tried=tried, total=total))
        self._note(worker.receive())


class _TuningJobs:
    """What the process holds: a loop of the drive, and where progress is sent."""

    def __init__(self, config: DriveConfig, progress: Connection) -> None:
        from pdtui.driving.ghost.ghost_simulation import build_ghost_loop

        self._loop, self._progress = build_ghost_loop(config), progress

    def run(self, behavior: str, minutes: float) -> GainTuningState:
        """Tune a behavior, and return the result."""
        from pdtui.core.outcome import is_failure
        from pdtui.search.gains.gain_search import TuningSettings
        from pdtui.search.gains.gain_tuning import tune_gains

        def tell(tried: int, total: int, _: str) -> None:
            self._progress.send((tried, total))

        settings = TuningSettings(_POINTS, _REFINEMENTS, minutes)
        (tuned,) = tune_gains(self._loop, [behavior], TUNING_SEEDS, settings=settings, progress=tell)
        offered: dict[PidGains, OfferedGains] = {}
        for origin, trial in sorted(tuned.trials.items(), key=lambda pair: pair[0] != tuned.kept):
            tracking = trial.tracking
            failures = sum(count for one, count in tracking.outcomes.items() if is_failure(one))
            drives = OfferedGains(origin, trial.pid, tracking.error, failures, len(tracking.seeds))
            offered.setdefault(trial.pid, drives)
        return GainTuningState(
            "done", behavior, tuned.verdict, tuned.tried, tuned.tried, tuple(offered.values())
        )
