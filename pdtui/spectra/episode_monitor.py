"""Step 1, monitor: run the policy without stimulation and record all hidden units and attributes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, unwrap_angles
from pdtui.core.errors import SimulationDiverged
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.robot import Robot


@dataclass(frozen=True)
class MonitoredEpisode:
    """One episode without stimulation.

    Row t holds one control step: the activations with which the policy chose the action, and the attributes
    of the state that this action led to, so that a torque is beside the activations that commanded it.

    Attributes:
        activations: outputs of the hidden units after their activation functions, shape (T, U).
        attributes: in their physical units, shape (T, J). Angles are unwrapped, because their jumps at ±π are
            no motion of the robot but would dominate the spectrum.
        ended: why the episode ended early; empty if it did not.
    """

    seed: int
    activations: NDArray[np.float32]
    attributes: Floats
    ended: str = ""

    @property
    def steps(self) -> int:
        """Number of control steps recorded."""
        return len(self.activations)


def monitor_episodes(
    robot: Robot,
    policy: Policy,
    seeds: Sequence[int],
    steps: int,
    progress: StepProgress | None = None,
    *,
    start: str = "",
) -> list[MonitoredEpisode]:
    """Run one episode per seed with the policy's mean action and no stimulation (section 3.2, "monitoring").

    The paper uses five episodes. Each lasts at most `steps` control steps, and begins in the state `start`,
    or in the robot's usual one.
    """
    episodes = []
    for seed in seeds:
        episodes.append(_record(robot, policy, seed, steps, start))
        if progress is not None:
            progress(len(episodes), len(seeds))
    return episodes


def _record(robot: Robot, policy: Policy, seed: int, steps: int, start: str) -> MonitoredEpisode:
    observation, _ = robot.reset(seed=seed, options={"start": start} if start else None)
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
