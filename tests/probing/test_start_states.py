from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.errors import RobotError
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.start_states import collect_start_states
from pdtui.robots import make_robot


def test_starts_are_where_the_walk_was(policy_file: Path) -> None:
    robot, policy = make_robot("ant"), load_policy(policy_file)
    starts = collect_start_states(robot, policy, 2000, 2, at=15)
    assert [(start.seed, start.step) for start in starts] == [(2000, 15), (2001, 15)]
    observation, _ = robot.reset(seed=2001)
    for _ in range(15):
        observation, *_ = robot.step(policy.act(observation).action)
    walked = robot.digest()
    robot.restore(starts[1].snapshot)
    assert robot.digest() == walked


def test_steps_of_a_range_are_spread_by_the_seed_of_the_walk(policy_file: Path) -> None:
    robot, policy = make_robot("ant"), load_policy(policy_file)
    starts = collect_start_states(robot, policy, 2000, 8, at=range(5, 16))
    steps = [start.step for start in starts]
    assert len(set(steps)) >= 4
    assert all(5 <= step <= 15 for step in steps)
    # A walk keeps its step, whichever other walks there are.
    later = collect_start_states(robot, policy, 2003, 2, at=range(5, 16))
    assert [start.step for start in later] == steps[3:5]


def test_a_policy_that_always_falls_is_refused(policy_file: Path) -> None:
    robot, policy = make_robot("ant"), load_policy(policy_file)
    robot.torso_heights = (0.9, 1.0)  # type: ignore[attr-defined]
    with pytest.raises(RobotError, match="expected 2 walks of 15 steps among 8 seeds, found 0: falls 8"):
        collect_start_states(robot, policy, 2000, 2, at=15)
