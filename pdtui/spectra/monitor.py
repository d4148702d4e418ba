"""Step 1, monitor: roll the policy out unstimulated and record every hidden unit and kinematic attribute."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, unwrap_angles
from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.robot_data import RobotState
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.recurrent_state import PolicyState
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

    def scaled(self, attributes: Sequence[Attribute]) -> Floats:
        """The attributes at the scale at which matching compares them, shape (T, J)."""
        scaled: Floats = self.attributes * np.array([attribute.scale for attribute in attributes])
        return scaled


@dataclass(frozen=True)
class StartState:
    """A state of an unstimulated walk from which stimulated roll-outs start.

    Attributes:
        seed: of the reset.
        step: control steps since the reset.
        snapshot: the whole state of the robot.
        policy_state: the hidden state of a recurrent policy.
    """

    seed: int
    step: int
    snapshot: RobotState
    policy_state: PolicyState = ()


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


def collect_start_states(
    robot: Robot, policy: Policy, first_seed: int, count: int, *, at: int = 100, survive: int = 0
) -> list[StartState]:
    """Snapshots of unstimulated walks, one a seed: other headings, other phases of the gait.

    Seeds whose unstimulated walk falls before step ``at + survive`` are passed over, so that a fall in a
    stimulated roll-out of that length is the stimulation's.

    Args:
        robot: the world; it is reset.
        policy: acts.
        first_seed: seeds count up from here.
        count: how many snapshots to take.
        at: control steps since the reset.
        survive: control steps that the walk has to go on.

    Raises:
        RobotError: among four times as many seeds too few walks last that long.
    """
    starts: list[StartState] = []
    for seed in range(first_seed, first_seed + 4 * count):
        start = _walk(robot, policy, seed, at, survive)
        if start is not None:
            starts.append(start)
        if len(starts) == count:
            return starts
    raise RobotError(
        f"{robot.name}: expected {count} walks of {at + survive} steps without a fall among {4 * count} "
        f"seeds, found {len(starts)}; dissection needs a policy that mostly stays up"
    )


def walk_lengths(
    robot: Robot, policy: Policy, seeds: Sequence[int], most: int, *, enough: int = 0
) -> list[int]:
    """Control steps that unstimulated walks last, one a seed: at most `most`.

    Args:
        robot: the world; it is reset.
        policy: acts.
        seeds: of the walks.
        most: where a walk is broken off.
        enough: so many walks of that length end it; 0 walks them all.
    """
    lengths: list[int] = []
    for seed in seeds:
        lengths.append(_length(robot, policy, seed, most))
        if enough and sum(length >= most for length in lengths) >= enough:
            break
    return lengths


def _length(robot: Robot, policy: Policy, seed: int, most: int) -> int:
    observation, _ = robot.reset(seed=seed)
    policy.reset()
    for step in range(most):
        try:
            observation, _, terminated, _, _ = robot.step(policy.act(observation).action)
        except SimulationDiverged:
            return step
        if terminated:
            # The state after the last step is a fall, so a walk that does without it is a step shorter.
            return step
    return most


def _walk(robot: Robot, policy: Policy, seed: int, at: int, survive: int) -> StartState | None:
    observation, _ = robot.reset(seed=seed)
    policy.reset()
    start = StartState(seed, 0, robot.snapshot(), policy.snapshot()) if at == 0 else None
    for step in range(1, at + survive + 1):
        try:
            observation, _, terminated, _, _ = robot.step(policy.act(observation).action)
        except SimulationDiverged:
            return None
        if terminated:
            return None
        if step == at:
            start = StartState(seed, at, robot.snapshot(), policy.snapshot())
    return start
