"""A batch of robots in a process of its own."""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.cluster.ray_worker import RayWorker
from pdtui.core.errors import TrainingError, WorkerError
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.robots import make_robot
from pdtui.training.robot_batch import RobotBatch, RobotBatchState, TransitionBatch


class RemoteRobotBatch(RobotBatch):
    """A `RobotBatch` in a process of its own, with the same results step for step.

    Args:
        robot: Name of the robot.
        options: Arguments of the robot's class.
        count: Number of robots.
        seed: Seed of their episodes.
        first: Number of the first robot, where the batch is a part of a larger one.
        cluster: Where the process runs; None for this machine.

    Raises:
        TrainingError: The process died.
    """

    def __init__(
        self,
        robot: str,
        options: dict[str, Any],
        count: int,
        seed: int,
        first: int = 0,
        cluster: RayCluster | None = None,
    ) -> None:
        make, name = partial(make_robot, robot, **options), f"worlds of {robot}"
        self.worker: WorkerProcess | RayWorker
        if cluster is None:
            self.worker = WorkerProcess(name, RobotBatch, make, count, seed, first)
        else:
            self.worker = cluster.start_worker(name, RobotBatch, make, count, seed, first)
        self._call("")

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        self.begin_step(actions)
        return self.end_step()

    def begin_step(self, actions: NDArray[np.float32]) -> None:
        """Begin to step every robot once."""
        self._send("step", actions)

    def end_step(self) -> TransitionBatch:
        """Return the transitions of the step that was begun."""
        return cast(TransitionBatch, self._receive())

    def state(self) -> RobotBatchState:
        return cast(RobotBatchState, self._call("state"))

    def restore(self, state: RobotBatchState) -> None:
        self._call("restore", state)

    def _call(self, name: str, *arguments: Any) -> Any:
        self._send(name, *arguments)
        return self._receive()

    def _send(self, name: str, *arguments: Any) -> None:
        try:
            self.worker.send(_call_batch, name, *arguments)
        except WorkerError as error:
            raise _describe_loss(error) from error

    def _receive(self) -> Any:
        try:
            answer, self.observations, self.restarted = self.worker.receive()
        except WorkerError as error:
            raise _describe_loss(error) from error
        return answer


def _describe_loss(error: WorkerError) -> TrainingError:
    return TrainingError(f"{error}; give the same command again to continue the run from its last checkpoint")


def _call_batch(batch: RobotBatch, name: str, *arguments: Any) -> tuple[Any, Any, Any]:
    answer = getattr(batch, name)(*arguments) if name else None
    return answer, batch.observations, batch.restarted
