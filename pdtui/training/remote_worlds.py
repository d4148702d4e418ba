"""Worlds in another process, for simulators that hold on to Python while they step."""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import TrainingError, WorkerError
from pdtui.core.worker_pool import WorkerProcess
from pdtui.robots import make_robot
from pdtui.training.sac import TransitionBatch
from pdtui.training.world_batch import WorldBatch, WorldBatchState


def _build_worlds(robot: str, options: dict[str, Any], count: int, seed: int) -> WorldBatch:
    return WorldBatch(partial(make_robot, robot, **options), count, seed)


def _call_worlds(worlds: WorldBatch, name: str, *arguments: Any) -> tuple[Any, Any, Any]:
    answer = getattr(worlds, name)(*arguments) if name else None
    return answer, worlds.observations, worlds.restarted


class RemoteWorldBatch(WorldBatch):
    """`WorldBatch` whose robots live in a process of their own; the same numbers, step for step.

    Args:
        robot: its name.
        options: for its class.
        count: how many.
        seed: of their episodes.

    Raises:
        TrainingError: the process died.
    """

    def __init__(self, robot: str, options: dict[str, Any], count: int, seed: int) -> None:
        self.worker = WorkerProcess(f"worlds of {robot}", _build_worlds, robot, options, count, seed)
        self._call("")

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        return cast(TransitionBatch, self._call("step", actions))

    def state(self) -> WorldBatchState:
        return cast(WorldBatchState, self._call("state"))

    def restore(self, state: WorldBatchState) -> None:
        self._call("restore", state)

    def _call(self, name: str, *arguments: Any) -> Any:
        try:
            self.worker.send(_call_worlds, name, *arguments)
            answer, self.observations, self.restarted = self.worker.receive()
        except WorkerError as error:
            raise TrainingError(
                f"{error}; the run goes on from its last checkpoint when the same command is given again"
            ) from error
        return answer
