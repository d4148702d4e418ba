"""Several copies of a robot, stepped together, each with its own episodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import SimulationDiverged
from pdtui.core.robot_data import RobotState
from pdtui.robots.robot import Robot, is_fall
from pdtui.training.sac import TransitionBatch

Actor = Callable[[NDArray[np.float32]], NDArray[np.float32]]


@dataclass
class WorldBatchState:
    """What a checkpoint must keep of the worlds."""

    snapshots: list[RobotState]
    ages: list[int]


class WorldBatch:
    """A batch of robots that start over by themselves."""

    def __init__(self, make: Callable[[], Robot], count: int, seed: int) -> None:
        self.robots = [make() for _ in range(count)]
        self.ages = [0] * count
        self.restarted = np.zeros(count, bool)
        start = [robot.reset(seed=seed * 1_000_003 + index)[0] for index, robot in enumerate(self.robots)]
        self.observations = np.array(start, np.float32)

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        """Step every robot once and return the transitions, leading axis (worlds,)."""
        before = self.observations.copy()
        after, reward, discount = before.copy(), np.zeros(len(before)), np.ones(len(before))
        for index, robot in enumerate(self.robots):
            try:
                observation, gained, terminated, truncated, info = robot.step(actions[index])
            except SimulationDiverged:
                observation, gained, info = before[index].astype(np.float64), 0.0, {}
                terminated, truncated = True, False
            self.ages[index] += 1
            after[index], reward[index], discount[index] = observation, float(gained), float(not terminated)
            over = self.ages[index] >= robot.episode_steps or info.get("finished", False)
            self.restarted[index] = terminated or truncated or over
            if self.restarted[index]:
                observation, self.ages[index] = robot.reset()[0], 0
            self.observations[index] = observation
        return TransitionBatch(before, actions, reward.astype(np.float32), discount.astype(np.float32), after)

    def state(self) -> WorldBatchState:
        return WorldBatchState([robot.snapshot() for robot in self.robots], list(self.ages))

    def restore(self, state: WorldBatchState) -> None:
        self.ages = list(state.ages)
        for index, (robot, snapshot) in enumerate(zip(self.robots, state.snapshots, strict=True)):
            robot.restore(snapshot)
            self.observations[index] = robot.observe()


@dataclass(frozen=True)
class ActorScore:
    """What mean actions reach: means over episodes."""

    episodes: int
    mean_return: float
    std_return: float
    mean_speed: float
    falls: int


def score_actor(make: Callable[[], Robot], actor: Actor, seeds: range, steps: int) -> ActorScore:
    """Run one episode a seed, all at once, with the given actor."""
    robots = [make() for _ in seeds]
    observations = np.array([robot.reset(seed=s)[0] for robot, s in zip(robots, seeds, strict=True)])
    speed_column = robots[0].attribute_index("speed")
    returns, speeds, lengths = np.zeros(len(robots)), [0.0] * len(robots), np.zeros(len(robots))
    fallen, over = np.zeros(len(robots), bool), np.zeros(len(robots), bool)
    for _ in range(steps):
        actions = actor(observations.astype(np.float32))
        for index in np.flatnonzero(~over):
            robot = robots[index]
            try:
                observation, reward, terminated, truncated, info = robot.step(actions[index])
            except SimulationDiverged:
                fallen[index] = over[index] = True
                continue
            observations[index] = observation
            returns[index] += float(reward)
            speeds[index] += float(robot.read_attributes()[speed_column])
            lengths[index] += 1
            fallen[index] = is_fall(terminated, info)
            over[index] = terminated or truncated or info.get("finished", False)
    mean_speed = float(np.mean(np.array(speeds) / np.maximum(lengths, 1)))
    return ActorScore(len(robots), float(returns.mean()), float(returns.std()), mean_speed, int(fallen.sum()))
