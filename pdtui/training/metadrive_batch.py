"""Several cars of MetaDrive, each in a process of its own, that drive at the same time."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from pdtui.robots.metadrive import MetaDrive
from pdtui.robots.robot import StepResult
from pdtui.training.robot_batch import RobotBatch


class MetaDriveBatch(RobotBatch):
    """A `RobotBatch` of cars whose engines work at the same time, and are kept from episode to episode.

    Args:
        robot: A car, whose options all have.
        count: Number of cars.
        seed: Seed of their episodes.
    """

    def __init__(self, robot: MetaDrive, count: int, seed: int) -> None:
        super().__init__(robot.make_alike, count, seed)

    def begin_steps(self, actions: NDArray[np.float32]) -> None:
        for car, action in zip(self.robots, actions, strict=True):
            cast(MetaDrive, car).send_action(action)

    def suggest_actions(self) -> NDArray[np.float32]:
        for car in self.robots:
            cast(MetaDrive, car).ask_rules()
        return np.array([cast(MetaDrive, car).receive_suggestion() for car in self.robots])

    def finish_step(self, index: int, action: NDArray[np.float32]) -> StepResult:
        del action
        return cast(MetaDrive, self.robots[index]).receive_step()
