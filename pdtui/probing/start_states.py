"""States of unstimulated walks from which stimulated roll-outs start."""

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


def measure_walk_lengths(
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
