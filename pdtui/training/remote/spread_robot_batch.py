"""A batch of robots whose parts lie on the nodes of a cluster."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.training.remote.remote_robot_batch import RemoteRobotBatch
from pdtui.training.robot_batch import RobotBatch, RobotBatchState, TransitionBatch


class SpreadRobotBatch(RobotBatch):
    """A `RobotBatch` in parts, each in a process of a cluster, with the same results step for step.

    Args:
        robot: Name of the robot.
        options: Arguments of the robot's class.
        count: Number of robots.
        seed: Seed of their episodes.
        cluster: The cluster.
        parts: Number of parts, one for each core that is to work; never more than there are robots.

    Raises:
        TrainingError: A process or a node was lost.
    """

    def __init__(
        self, robot: str, options: dict[str, Any], count: int, seed: int, cluster: RayCluster, parts: int
    ) -> None:
        sizes = [len(share) for share in np.array_split(np.arange(count), max(1, min(parts, count)))]
        self._edges = np.cumsum(sizes)[:-1]
        firsts = [0, *self._edges.tolist()]
        self._parts = [
            RemoteRobotBatch(robot, options, size, seed, first, cluster)
            for size, first in zip(sizes, firsts, strict=True)
        ]
        self._gather()

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        for part, share in zip(self._parts, np.split(actions, self._edges), strict=True):
            part.begin_step(share)
        rows = [part.end_step() for part in self._parts]
        self._gather()
        return TransitionBatch(*map(np.concatenate, zip(*rows, strict=True)))

    def state(self) -> RobotBatchState:
        states = [part.state() for part in self._parts]
        return RobotBatchState(
            [snapshot for state in states for snapshot in state.snapshots],
            [age for state in states for age in state.ages],
        )

    def restore(self, state: RobotBatchState) -> None:
        edges = [0, *self._edges.tolist(), len(state.ages)]
        for part, low, high in zip(self._parts, edges, edges[1:], strict=False):
            part.restore(RobotBatchState(state.snapshots[low:high], state.ages[low:high]))
        self._gather()

    def close(self) -> None:
        """End the processes."""
        for part in self._parts:
            part.worker.close()

    def _gather(self) -> None:
        self.observations = np.concatenate([part.observations for part in self._parts])
        self.restarted = np.concatenate([part.restarted for part in self._parts])
