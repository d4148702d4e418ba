"""The process of a search for units, for which the drive never waits."""

from __future__ import annotations

import time
from dataclasses import replace

from pdtui.core.closable import Closable
from pdtui.core.processes.background_worker import BackgroundWorker
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_simulation import GhostStart, answer_when_loaded, build_ghost_loop
from pdtui.driving.unit_bench.natural_ranges import NaturalRanges
from pdtui.driving.unit_bench.unit_search_rollouts import judge_rollout, rank_candidates, run_search_rollout
from pdtui.driving.unit_bench.unit_search_snapshot import FoundUnit, UnitSearchRequest, UnitSearchSnapshot

OFFERED = 3
"""Units that a search offers."""

LEAST_ROLLOUTS = 16
"""Roll-outs that a search makes even where they take longer than its time."""


class UnitSearchProcess(Closable):
    """Searches for units in a worker process, which is kept for later searches.

    Args:
        config: the drive.
    """

    def __init__(self, config: DriveConfig) -> None:
        config = replace(config, recording="", viewer=None, watched=None)
        self._worker = BackgroundWorker("the search for units", build_ghost_loop, config)
        self.state: UnitSearchSnapshot | None = None
        """How the present search stands; None before the first."""

    @property
    def is_searching(self) -> bool:
        """Whether a search is under way."""
        return self._worker.is_busy

    def search(
        self, request: UnitSearchRequest, start: GhostStart, column: int, ranges: NaturalRanges | None
    ) -> None:
        """Begin a search, which goes on until its time is over.

        Args:
            request: what is searched for.
            start: the moment from which all roll-outs begin.
            column: column of the attribute.
            ranges: what the units put out by themselves.
        """
        self.state = UnitSearchSnapshot("loading", request=request)
        self._worker.submit(
            lambda worker: self._search(worker, request, start, column, ranges),
            lambda said: self.fail(request, f"no search: {said}"),
        )

    def fail(self, request: UnitSearchRequest, reason: str) -> None:
        """Note that there is no search."""
        self.state = UnitSearchSnapshot("failed", reason, request)

    def close(self) -> None:
        """Kill the process."""
        self._worker.close()

    def _search(
        self,
        worker: WorkerProcess,
        request: UnitSearchRequest,
        start: GhostStart,
        column: int,
        ranges: NaturalRanges | None,
    ) -> None:
        worker.send(answer_when_loaded)
        worker.receive()
        worker.send(rank_candidates, start, ranges)
        candidates = worker.receive()
        worker.send(run_search_rollout, start, column, None)
        plain = worker.receive()
        deadline = time.monotonic() + request.seconds
        found: list[FoundUnit] = []
        for number, candidate in enumerate(candidates, start=1):
            worker.send(run_search_rollout, start, column, candidate)
            judged = judge_rollout(candidate, worker.receive(), plain)
            found += [judged] if judged is not None else []
            late = number >= LEAST_ROLLOUTS and time.monotonic() > deadline
            over = late or number == len(candidates)
            self.state = UnitSearchSnapshot(
                "done" if over else "searching",
                request=request,
                step=start.step,
                rollouts=number,
                steps=plain.steps,
                best=choose_best(found, request.sign),
            )
            if over:
                return


def choose_best(found: list[FoundUnit], sign: float) -> tuple[FoundUnit, ...]:
    """Return the units with the largest effect in a direction, one output each; those that fall come last."""
    best: dict[int, FoundUnit] = {}
    for one in sorted(found, key=lambda one: (one.fell, -sign * one.effect)):
        if sign * one.effect > 0.0:
            best.setdefault(one.unit, one)
    return tuple(best.values())[:OFFERED]
