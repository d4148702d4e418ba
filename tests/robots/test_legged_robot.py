"""A legged robot that somebody describes: its world, its commands, and what is wrong with a description."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.robots.legged.legged_robot_description import LeggedRobotDescription
from pdtui.robots.legged.legged_robot_state import LeggedStateReader
from pdtui.robots.legged.observations_and_rewards import compute_legged_rewards
from tests.small_legged_robot import SmallLeggedRobot, describe_small_robot


@pytest.fixture
def robot(tmp_path: Path) -> SmallLeggedRobot:
    built = SmallLeggedRobot(describe_small_robot(tmp_path))
    built.reset(seed=3)
    return built


def test_a_described_robot_observes_its_joints_and_has_attributes_for_them(robot: SmallLeggedRobot) -> None:
    names = [attribute.name for attribute in robot.attributes]
    assert {"left_hip torque", "right_hip torque", "forward command"} <= set(names)
    observation, *_ = robot.step(np.array([0.5, -0.5], np.float32))
    assert observation.shape == robot.observation_space.shape == (10 + 3 + 3 * 2,)
    np.testing.assert_allclose(observation[-2:], [0.5, -0.5])


def test_it_stands_and_falls_by_its_own_rule(robot: SmallLeggedRobot) -> None:
    assert not any(robot.step(np.zeros(2, np.float32))[2] for _ in range(50))
    robot.data.qpos[3:7] = 0.0, 1.0, 0.0, 0.0  # upside down
    *_, fell, _, info = robot.step(np.zeros(2, np.float32))
    assert fell
    assert info["reason"].startswith("fell: trunk at")


def test_standing_on_one_foot_is_rewarded_only_while_it_is_to_move(robot: SmallLeggedRobot) -> None:
    weights = replace(
        robot.description.rewards, one_foot=0.5, single_stance=2.0, swing=0.0, slip=0.0, steps=0.0
    )
    one = replace(robot.description, rewards=weights)
    state = robot.read_state()
    times, fell = np.array([[[0.3, -0.3], [0.0, 0.1]]]), np.zeros(1, bool)

    def reward(touching: list[bool], forward: float) -> float:
        now = replace(
            state,
            touching=np.array([touching]),
            command=np.array([[forward, 0.0, 0.0]]),
            qvel=0.0 * state.qvel,
        )
        return float(compute_legged_rewards(now, times, 0.02, one, fell)[0][0])

    both, single = reward([True, True], 0.5), reward([False, True], 0.5)
    assert single - both == pytest.approx((0.5 + 2.0 * 0.32) * 0.02)
    assert reward([False, True], 0.0) == pytest.approx(reward([True, True], 0.0))
    # The foot on the ground swung for 0.1 s, and the other one is in the air for 0.32 s.
    one = replace(robot.description, rewards=replace(weights, longer_swing=0.2))
    assert reward([False, True], 0.5) == pytest.approx(reward([True, True], 0.5))
    one = replace(robot.description, rewards=replace(weights, longer_swing=0.24))
    assert reward([False, True], 0.5) == pytest.approx(single)


def test_foot_times_count_up_in_the_air_and_down_on_the_ground(robot: SmallLeggedRobot) -> None:
    state, fell = robot.read_state(), np.zeros(1, bool)
    state = replace(state, touching=np.array([[False, True]]))
    before = ((0.3, 0.3), (-0.3, -0.3))
    after = ((0.32, -0.02), (0.02, -0.32))
    swings = ((0.1, 0.3), (0.1, 0.2))  # the right foot has just landed, or not
    for since, now, swing in zip(before, after, swings, strict=True):
        times = np.array([[since, (0.1, 0.2)]])
        new = compute_legged_rewards(state, times, 0.02, robot.description, fell)[1]
        np.testing.assert_allclose(new, [[now, swing]])


def test_a_sensor_that_the_model_lacks_is_named(robot: SmallLeggedRobot) -> None:
    wrong: LeggedRobotDescription = replace(robot.description, feet=("left", "middle"))
    with pytest.raises(RobotError, match=r"small\.xml: no sensor 'middle'; available: left, right, left_vel"):
        LeggedStateReader(robot.model, wrong)


def test_a_robot_without_rough_ground_has_one_terrain(robot: SmallLeggedRobot) -> None:
    with pytest.raises(RobotError, match="no terrain 'rough'; available: plane"):
        SmallLeggedRobot(robot.description, terrain="rough")
