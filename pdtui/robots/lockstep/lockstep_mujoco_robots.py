"""Copies of a MuJoCo robot that are stepped together, each with data of its own."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import SimulationDiverged
from pdtui.core.outcome import Outcome
from pdtui.core.robot_links_and_state import RobotState

if TYPE_CHECKING:
    from pdtui.robots.simulators.mujoco_robot import MujocoRobot


class LockstepMujocoRobots:
    """Copies of a MuJoCo robot, with the interface of `LockstepRobots`.

    Each has data of its own, which the robot works on in turn: what they compute is the robot's own, to the
    last bit. The robot's step must not draw random numbers.

    Args:
        robot: The robot, in any state in which it has been reset.
        count: Number of copies.
    """

    def __init__(self, robot: MujocoRobot, count: int) -> None:
        self._robot = robot
        self._data = [mujoco.MjData(robot.model) for _ in range(count)]
        self._arrays = [{name: getattr(robot, name) for name in robot.state_arrays} for _ in range(count)]
        self.observations = np.zeros((count, *robot.observe().shape))
        self.attributes = np.zeros((count, len(robot.attributes)))

    def world_key(self, state: RobotState) -> Hashable:
        del state
        return None

    def restore(self, row: int, state: RobotState) -> None:
        robot = self._robot
        with self._borrowed():
            self._become(row)
            robot.restore(state)
            self._keep_arrays(row)
            self.observations[row], self.attributes[row] = robot.observe(), robot.read_attributes()

    def step(self, rows: Sequence[int], actions: Floats) -> list[Outcome | None]:
        robot = self._robot
        outcomes: list[Outcome | None] = []
        with self._borrowed():
            for row, action in zip(rows, actions, strict=True):
                self._become(row)
                try:
                    observation, _, terminated, truncated, info = robot.step(action.astype(np.float32))
                except SimulationDiverged:
                    outcomes.append(Outcome.DIVERGED)
                    continue
                self._keep_arrays(row)
                self.observations[row], self.attributes[row] = observation, robot.read_attributes()
                over = terminated or truncated
                outcomes.append(robot.outcome_of(terminated, truncated, info) if over else None)
        return outcomes

    def _become(self, row: int) -> None:
        self._robot.data = self._data[row]
        for name, array in self._arrays[row].items():
            setattr(self._robot, name, array)

    def _keep_arrays(self, row: int) -> None:
        for name in self._arrays[row]:
            self._arrays[row][name] = getattr(self._robot, name)

    @contextmanager
    def _borrowed(self) -> Iterator[None]:
        """Give the robot its own data back after the block."""
        own = self._robot.data
        try:
            yield
        finally:
            self._robot.data = own
