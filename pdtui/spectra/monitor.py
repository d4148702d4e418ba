"""Step 1, monitor: roll the policy out unstimulated and record every hidden unit and kinematic attribute."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, unwrap_angles
from pdtui.core.errors import SimulationDiverged
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.robot import Robot

StepProgress = Callable[[int, int], None]


@dataclass(frozen=True)
class MonitoredEpisode:
    """One unstimulated roll-out.

    Row t holds one control step: the activations with which the policy chose the action, and the attributes
    of the state that this action led to (so a torque stands beside the activations that commanded it).

    Attributes:
        seed: of the reset.
        activations: outputs after the activation functions, shape (T, U).
        attributes: in their physical units, shape (T, J). An attribute that wraps (a yaw) is unwrapped: its
            jumps at ±π are no motion of the robot, but would dominate its spectrum.
        ended: why the episode ended before T, empty where it did not.
    """

    seed: int
    activations: NDArray[np.float32]
    attributes: Floats
    ended: str = ""

    @property
    def steps(self) -> int:
        """Control steps recorded."""
        return len(self.activations)


def monitor_episodes(
    robot: Robot, policy: Policy, seeds: Sequence[int], steps: int, progress: StepProgress | None = None
) -> list[MonitoredEpisode]:
    """Roll the policy out once a seed, with its mean action and no stimulation (section 3.2, "monitoring").

    Args:
        robot: the world; it is reset.
        policy: acts.
        seeds: one of each episode (the paper: five).
        steps: T, at most; an episode ends earlier where the robot does.
        progress: called with (episodes done, episodes).
    """
    episodes = []
    for seed in seeds:
        episodes.append(_record(robot, policy, seed, steps))
        if progress is not None:
            progress(len(episodes), len(seeds))
    return episodes


def _record(robot: Robot, policy: Policy, seed: int, steps: int) -> MonitoredEpisode:
    observation, _ = robot.reset(seed=seed)
    policy.reset()
    activations, attributes, ended = [], [], ""
    for _ in range(steps):
        acted = policy.act(observation)
        try:
            observation, _, terminated, truncated, info = robot.step(acted.action)
        except SimulationDiverged as error:
            ended = str(error)
            break
        activations.append(acted.activations)
        attributes.append(robot.read_attributes())
        if terminated or truncated:
            ended = str(info.get("reason", "the episode is over"))
            break
    values = np.array(attributes, np.float64).reshape(-1, len(robot.attributes))
    smooth = unwrap_angles(values, robot.attributes)
    return MonitoredEpisode(seed, np.array(activations, np.float32).reshape(-1, policy.units), smooth, ended)
