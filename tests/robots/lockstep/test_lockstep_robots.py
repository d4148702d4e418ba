"""Copies that are stepped together do what the robot does alone."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot

STEPS = 40
Walk = tuple[list[Floats], list[Floats], Outcome | None]
"""Observations and attributes of a walk, and how it ended."""


def _walk_alone(
    robot: Robot, seed: int, start: str
) -> tuple[list[np.ndarray], list[np.ndarray], Outcome | None]:
    """Return observations and attributes of a walk with random actions, until it ends."""
    rng = np.random.default_rng(seed)
    robot.reset(seed=seed, options={"start": start} if start else None)
    seen, measured = [], []
    for _ in range(STEPS):
        action = rng.uniform(-1, 1, robot.action_space.shape).astype(np.float32)
        observation, _, terminated, truncated, info = robot.step(action)
        seen.append(observation)
        measured.append(robot.read_attributes())
        if terminated or truncated:
            return seen, measured, robot.outcome_of(terminated, truncated, info)
    return seen, measured, None


@pytest.mark.parametrize(("name", "start"), [("anymal", ""), ("cassie", ""), ("cassie", "rough")])
def test_copies_repeat_the_robots_own_walks(name: str, start: str) -> None:
    with make_robot(name) as robot:
        options = {"start": start} if start else None
        states = []
        for seed in (0, 1, 2):
            robot.reset(seed=seed, options=options)
            states.append(robot.snapshot())
        copies = robot.make_lockstep_robots(3)
        assert copies is not None
        # Copies share their world: on rough ground, each seed has its own.
        shared = [row for row in range(3) if copies.world_id(states[row]) == copies.world_id(states[0])]
        assert shared == ([0] if start == "rough" else [0, 1, 2])
        for row in shared:
            copies.restore(row, states[row])
        draws = {row: np.random.default_rng(row) for row in shared}
        walks: dict[int, Walk] = {row: ([], [], None) for row in shared}
        going = list(shared)
        for _ in range(STEPS):
            actions = np.array(
                [draws[row].uniform(-1, 1, robot.action_space.shape).astype(np.float32) for row in going]
            )
            for row, outcome in zip(going, copies.step(going, actions), strict=True):
                seen, measured, _ = walks[row]
                seen.append(copies.observations[row].copy())
                measured.append(copies.attributes[row].copy())
                walks[row] = (seen, measured, outcome)
            going = [row for row in going if walks[row][2] is None]
        for row in shared:
            seen, measured, outcome = _walk_alone(robot, row, start)
            assert len(seen) == len(walks[row][0])
            np.testing.assert_allclose(walks[row][0], seen, rtol=0, atol=1e-9)
            np.testing.assert_allclose(walks[row][1], measured, rtol=0, atol=1e-9)
            assert walks[row][2] == outcome


def test_a_fall_is_told_like_the_robots_own() -> None:
    action = np.array([0.0, 3.0, -3.0] * 4, np.float32)
    with make_robot("anymal") as robot:
        robot.reset(seed=0)
        state = robot.snapshot()
        ended = [robot.step(action)[2] for _ in range(200)]
        copies = robot.make_lockstep_robots(1)
        assert copies is not None
        copies.restore(0, state)
        outcomes = [copies.step([0], action[None])[0] for _ in range(200)]
    assert True in ended, "it never fell: the test shows nothing"
    assert ended.index(True) == outcomes.index(Outcome.FELL)
    assert set(outcomes[: ended.index(True)]) == {None}


def test_robots_whose_rounding_grows_into_other_walks_have_no_copies() -> None:
    with make_robot("ant") as robot:
        assert robot.make_lockstep_robots(4) is None
