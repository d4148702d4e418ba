"""Several copies of a robot that are stepped together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import SimulationDiverged, TrainingError
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.robot import Robot, StepResult


class TransitionBatch(NamedTuple):
    """Transitions, float32 arrays of NumPy or JAX that share their leading axes.

    `discount` is 0 where the episode terminated, else 1; `following` is the observation after the step.
    """

    observation: Any
    action: Any
    reward: Any
    discount: Any
    following: Any


@dataclass
class RobotBatchState:
    """The states of all robots of a batch, and the control steps that each has taken in its episode."""

    snapshots: list[RobotState]
    ages: list[int]


class RobotBatch:
    """A batch of robots, each of which begins a new episode when the last one is over.

    Attributes:
        observations: Current observations, shape (robots, observations), float32.
        restarted: Whether the last step of each robot ended its episode, shape (robots,).

    Args:
        make: Builds one robot.
        count: Number of robots.
        seed: Seed of their episodes.
        first: Number of the first robot, where the batch is a part of a larger one.
    """

    def __init__(self, make: Callable[[], Robot], count: int, seed: int, first: int = 0) -> None:
        self.robots = [make() for _ in range(count)]
        self.ages = [0] * count
        self.restarted = np.zeros(count, bool)
        # The factor keeps the seeds of different batches apart.
        seeds = [seed * 1_000_003 + first + index for index in range(count)]
        start = [robot.reset(seed=its_own)[0] for robot, its_own in zip(self.robots, seeds, strict=True)]
        self.observations = np.array(start, np.float32)

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        """Step every robot once and return the transitions, leading axis (robots,)."""
        before = self.observations.copy()
        after, reward, discount = before.copy(), np.zeros(len(before)), np.ones(len(before))
        self.begin_steps(actions)
        for index, robot in enumerate(self.robots):
            try:
                observation, gained, terminated, truncated, info = self.finish_step(index, actions[index])
            except SimulationDiverged:
                observation, gained, info = before[index].astype(np.float64), 0.0, {}
                terminated, truncated = True, False
            self.ages[index] += 1
            after[index], reward[index], discount[index] = observation, float(gained), float(not terminated)
            outcome = robot.outcome_of(terminated, truncated, info)
            self.restarted[index] = outcome is not None or self.ages[index] >= robot.episode_steps
            if self.restarted[index]:
                observation, self.ages[index] = robot.reset()[0], 0
            self.observations[index] = observation
        return TransitionBatch(before, actions, reward.astype(np.float32), discount.astype(np.float32), after)

    def begin_steps(self, actions: NDArray[np.float32]) -> None:
        """Begin the step of every robot, where robots can step at the same time."""

    def finish_step(self, index: int, action: NDArray[np.float32]) -> StepResult:
        """Return the result of a robot's step."""
        observation, gained, terminated, truncated, info = self.robots[index].step(action)
        return observation, float(gained), terminated, truncated, info

    def suggest_actions(self) -> NDArray[np.float32]:
        """Return what a rule-based driver of each robot would do now, shape (robots, actions).

        Raises:
            TrainingError: The robot has none.
        """
        raise TrainingError(f"{self.robots[0].name}: expected a robot with a rule-based driver to imitate")

    def state(self) -> RobotBatchState:
        """Return what `restore` needs."""
        return RobotBatchState([robot.snapshot() for robot in self.robots], list(self.ages))

    def restore(self, state: RobotBatchState) -> None:
        """Return to an earlier state, bit-exactly."""
        self.ages = list(state.ages)
        for index, (robot, snapshot) in enumerate(zip(self.robots, state.snapshots, strict=True)):
            robot.restore(snapshot)
            self.observations[index] = robot.observe()
