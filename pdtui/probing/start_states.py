"""States of unstimulated walks in which stimulated roll-outs start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.outcome import Outcome, count_outcomes, describe_outcomes
from pdtui.core.robot_links_and_state import RobotState
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.recurrent_state import PolicyState
from pdtui.robots.robot import Robot


@dataclass(frozen=True)
class StartState:
    """A state of an unstimulated walk in which stimulated roll-outs start.

    Attributes:
        step: control steps since the reset.
        snapshot: the robot's whole state.
        policy_state: hidden state of a recurrent policy.
    """

    seed: int
    step: int
    snapshot: RobotState
    policy_state: PolicyState = ()


def collect_start_states(
    robot: Robot, policy: Policy, first_seed: int, count: int, *, at: int | range = 100
) -> list[StartState]:
    """Take one state from each of several unstimulated walks, which differ in heading and phase of the gait.

    The state is taken `at` control steps after the reset; from a range, the walk's seed draws the step.
    Where resets hardly differ, walks are at the same phase of the gait at the same step, and intervals over
    them would be too narrow. Seeds whose walk ends before, by a failure or because the robot has arrived,
    are skipped, but not those whose walk would end later: to leave out those that fall would flatter every
    stimulation.

    Raises:
        RobotError: too few of ``4 * count`` walks last that long.
    """
    steps = range(at, at + 1) if isinstance(at, int) else at
    starts: list[StartState] = []
    ends: list[Outcome | None] = []
    for seed in range(first_seed, first_seed + 4 * count):
        taken = steps[int(np.random.default_rng(seed).integers(len(steps)))]
        for step in _walk(robot, policy, seed, taken, ends):
            if step == taken:
                starts.append(StartState(seed, taken, robot.snapshot(), policy.snapshot()))
        if len(starts) == count:
            return starts
    raise RobotError(
        f"{robot.name}: expected {count} walks of {steps[-1]} steps among {4 * count} seeds, found "
        f"{len(starts)}: {describe_outcomes(count_outcomes(ends))}; dissection needs longer walks"
    )


def measure_walk_lengths(robot: Robot, policy: Policy, seeds: Sequence[int], most: int) -> list[int]:
    """Return for how many control steps unstimulated walks last, in the order of their seeds.

    Walks are broken off after `most` steps.
    """
    lengths: list[int] = []
    for seed in seeds:
        *_, length = _walk(robot, policy, seed, most, [])
        lengths.append(length)
    return lengths


def _walk(robot: Robot, policy: Policy, seed: int, most: int, ends: list[Outcome | None]) -> Iterator[int]:
    """Yield 0 after the reset, and then the number of each control step with which the walk does not end.

    The outcome of a walk that ends is added to `ends`.
    """
    observation, _ = robot.reset(seed=seed)
    policy.reset()
    yield 0
    for step in range(1, most + 1):
        try:
            observation, outcome, ended = robot.step_without_reward(policy.act(observation).action)
        except SimulationDiverged:
            ends.append(Outcome.DIVERGED)
            return
        if ended:
            ends.append(outcome)
            return
        yield step
