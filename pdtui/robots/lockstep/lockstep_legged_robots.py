"""Copies of a legged robot that are stepped together: all but the physics is computed for all at once."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import SimulationDiverged
from pdtui.core.outcome import Outcome
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.legged.observations_and_rewards import compute_legged_observations, has_fallen
from pdtui.robots.simulators.mujoco_robot import check_state_is_finite

if TYPE_CHECKING:
    from pdtui.robots.legged.legged_robot import LeggedRobot


class LockstepLeggedRobots:
    """Copies of a legged robot on the same ground, with the interface of `LockstepRobots`.

    The physics is the robot's own, to the last bit; observations and attributes are, to rounding. They earn
    no rewards.

    Args:
        robot: The robot.
        count: Number of copies.
    """

    def __init__(self, robot: LeggedRobot, count: int) -> None:
        self._robot, joints = robot, len(robot.description.default_angles)
        self._data = [mujoco.MjData(robot.model) for _ in range(count)]
        self._action, self._last_action = np.zeros((count, joints)), np.zeros((count, joints))
        self._commands = np.zeros((count, len(robot.command_names)))
        self.observations = np.zeros((count, robot.description.observations))
        self.attributes = np.zeros((count, len(robot.attributes)))

    def world_id(self, state: RobotState) -> Hashable:
        # The ground is in the model, which all copies share: a plane is the same for all seeds. Any other
        # world may have state of its own, so that no two share it.
        terrain, seed = state.extras[0].tolist()
        name = self._robot.starts[int(terrain)] if self._robot.starts else "plane"
        shared: dict[str, Hashable] = {"plane": None, "rough": seed}
        return shared.get(name, object())

    def restore(self, row: int, state: RobotState) -> None:
        robot, own = self._robot, self._robot.data
        robot.data = self._data[row]
        try:
            robot.restore(state)
            self._action[row], self._last_action[row], self._commands[row] = robot.read_controls()
            self.observations[row], self.attributes[row] = robot.observe(), robot.read_attributes()
        finally:
            robot.data = own

    def step(self, rows: Sequence[int], actions: NDArray[np.float32]) -> list[Outcome | None]:
        robot, one = self._robot, self._robot.description
        chosen = np.array(rows, np.intp)
        self._last_action[chosen], self._action[chosen] = self._action[chosen], actions
        targets = one.stance + one.action_scale * self._action[chosen]
        diverged = np.zeros(len(chosen), bool)
        for number, (row, target) in enumerate(zip(rows, targets, strict=True)):
            data = self._data[row]
            data.ctrl[:] = target
            mujoco.mj_step(robot.model, data, one.substeps)
            try:
                check_state_is_finite(data, robot.name)
            except SimulationDiverged:
                diverged[number] = True
        moved = [self._data[row] for row in rows]
        actions_taken = self._action[chosen], self._last_action[chosen]
        motion = robot.read_states(moved, actions_taken, self._commands[chosen])
        self.observations[chosen] = compute_legged_observations(motion, one)
        self.attributes[chosen] = robot.compute_attributes(motion, self._commands[chosen])
        fell = has_fallen(motion, one.fall)
        words = np.where(diverged, Outcome.DIVERGED, np.where(fell, Outcome.FELL, ""))
        return [Outcome(word) if word else None for word in words.tolist()]
