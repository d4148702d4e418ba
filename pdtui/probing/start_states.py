"""States of unstimulated walks in which stimulated roll-outs start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.robot_data import RobotState
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.recurrent_state import PolicyState
from pdtui.robots.robot import Robot


@dataclass(frozen=True)
class StartState:
    """A state of an unstimulated walk in which stimulated roll-outs start.

    Attributes:
        seed: seed of the reset.
        step: control steps since the reset.
        snapshot: the robot's whole state.
        policy_state: hidden state of a recurrent policy.
    """

    seed: int
    step: int
    snapshot: RobotState
    policy_state: PolicyState = ()


def collect_start_states(
    robot: Robot, policy: Policy, first_seed: int, count: int, *, at: int = 100, survive: int = 0
) -> list[StartState]:
    """Take one state from each of several unstimulated walks, which differ in heading and phase of the gait.

    Seeds whose walk falls before step ``at + survive`` are skipped, so that a fall within `survive` steps of
    a stimulated roll-out is due to the stimulation.

    Args:
        robot: the robot; it is reset.
        policy: the policy, which acts with its mean action.
        first_seed: seed of the first walk; the others follow.
        count: number of states.
        at: control steps from the reset to the state.
        survive: control steps for which the walk has to go on without a fall.

    Raises:
        RobotError: too few of ``4 * count`` walks last that long.
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


def measure_walk_lengths(
    robot: Robot, policy: Policy, seeds: Sequence[int], most: int, *, enough: int = 0
) -> list[int]:
    """Return for how many control steps unstimulated walks last, in the order of their seeds.

    Args:
        robot: the robot; it is reset.
        policy: the policy, which acts with its mean action.
        seeds: one seed per walk.
        most: step at which a walk is broken off.
        enough: stop after this many walks of `most` steps; 0 for never.
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
            observation, _, terminated, truncated, _ = robot.step(policy.act(observation).action)
        except SimulationDiverged:
            return step
        if terminated or truncated:
            # The state after the last step is a fall, so a walk that does without it is a step shorter.
            return step
    return most


def _walk(robot: Robot, policy: Policy, seed: int, at: int, survive: int) -> StartState | None:
    observation, _ = robot.reset(seed=seed)
    policy.reset()
    start = StartState(seed, 0, robot.snapshot(), policy.snapshot()) if at == 0 else None
    for step in range(1, at + survive + 1):
        try:
            observation, _, terminated, truncated, _ = robot.step(policy.act(observation).action)
        except SimulationDiverged:
            return None
        if terminated or truncated:
            return None
        if step == at:
            start = StartState(seed, at, robot.snapshot(), policy.snapshot())
    return start
