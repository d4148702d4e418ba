"""Many legged robots at once: the same motion as one alone, and a state that goes on where it was."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("jax", reason="the extra 'train' is not installed")

from pdtui.robots.anymal import Anymal
from pdtui.robots.cassie import Cassie
from pdtui.robots.legged.legged_robot_state import compute_yaws
from pdtui.robots.legged.mujoco_ground import lay_rough_ground
from pdtui.robots.legged.terrain import draw_rough_ground
from pdtui.training.legged_robot_batch import LeggedRobotBatch
from pdtui.training.terrain_curriculum import TerrainCurriculum
from tests.small_legged_robot import SmallLeggedRobot, describe_small_robot


def _actions(count: int, worlds: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, worlds, 12)).astype(np.float32)


def test_a_world_moves_as_a_robot_alone_does() -> None:
    worlds, robot = LeggedRobotBatch(Anymal(), 8, 0, 1000), Anymal()
    robot.reset(seed=0)
    start = worlds.state().snapshots[0].state[3]
    robot.model.geom_friction[:, 0] = worlds.frictions[3]
    robot.data.qpos[:], robot.data.qvel[:] = start[1:20], start[20:]
    for actions in 0.3 * _actions(10, 8):
        worlds.step(actions)
        robot.step(actions[3])
    end = worlds.state().snapshots[0].state[3]
    # The single robot keeps its solver's warm start, which the batch begins without.
    np.testing.assert_allclose(end[1:20], robot.data.qpos, atol=1e-3)


def test_a_cassie_on_rough_ground_moves_and_observes_as_one_alone_does() -> None:
    robot = Cassie(terrain="rough", roughness=0.08)
    worlds = LeggedRobotBatch(robot, 8, 0, 1000)
    state = worlds.state()
    state.snapshots[0].extras[-1][:] = 5.0  # the roughest ground
    worlds.restore(state)
    robot.reset(seed=0)
    start = state.snapshots[0].state[3]
    assert not np.allclose(start[1:3], 0.0)
    robot.ground = draw_rough_ground(np.random.default_rng(20_005), 0.08)
    lay_rough_ground(robot.model, robot.ground)
    robot.model.geom_friction[:, 0] = worlds.frictions[3]
    robot.data.qpos[:], robot.data.qvel[:] = start[1:20], start[20:]
    robot.data.qpos[2] -= 0.15  # so that its feet soon touch the ground
    state.snapshots[0].state[3, 3] -= 0.15
    worlds.restore(state)
    for actions in 0.2 * _actions(8, 8):
        seen = worlds.step(actions).following[3]
        alone, *_ = robot.step(actions[3])
    assert robot.read_state().touching.any()
    end = worlds.state().snapshots[0].state[3]
    np.testing.assert_allclose(end[1:20], robot.data.qpos, atol=2e-3)
    np.testing.assert_allclose(seen[49:], alone[49:], atol=0.12)  # with the noise of 2 cm


def test_robots_that_stay_on_their_feet_go_on_to_rougher_ground() -> None:
    grounds, rng = TerrainCurriculum(Cassie(terrain="rough"), 4), np.random.default_rng(0)
    over = np.array([True, True, False, True])
    grounds.update_levels(over, np.array([False, True, False, False]), rng)
    assert grounds.levels.tolist() == [1, 0, 0, 1]
    assert not grounds.models[1].hfield_data.any()
    assert 0.0 < grounds.models[0].hfield_data.max() <= 0.2 * 0.05 + 1e-6
    grounds.update_levels(over, np.array([True, False, False, False]), rng)
    assert grounds.levels.tolist() == [0, 1, 0, 2]


def test_a_cassie_is_commanded_a_heading_near_its_own() -> None:
    worlds = LeggedRobotBatch(Cassie(terrain="rough"), 32, 0)
    state = worlds.state().snapshots[0]
    command, yaws = state.extras[0], compute_yaws(state.state[:, 1:20])
    assert (np.abs(command[:, 2] - yaws) <= 1.5).all()
    assert np.ptp(command[:, 2] - yaws) > 1.0
    assert (command[:, 1] == 0.0).all()
    standing = command[:, 0] == 0.0
    np.testing.assert_allclose(command[standing, 2], yaws[standing])


def test_a_robot_that_somebody_describes_is_trained_together(tmp_path: Path) -> None:
    robot = SmallLeggedRobot(describe_small_robot(tmp_path))
    worlds = LeggedRobotBatch(robot, 8, 0, 100)
    assert worlds.observations.shape == (8, 19)
    rewards = [worlds.step(np.zeros((8, 2), np.float32)).reward for _ in range(30)]
    assert np.min(rewards) >= 0.0
    assert np.max(rewards) > 0.0


def test_a_restored_state_goes_on_the_same() -> None:
    worlds, other = (
        LeggedRobotBatch(Cassie(terrain="rough"), 6, 0, 40),
        LeggedRobotBatch(Cassie(terrain="rough"), 6, 9, 40),
    )
    for actions in _actions(15, 6):
        worlds.step(actions)
    other.restore(worlds.state())
    for actions in _actions(45, 6, 1):
        first, again = worlds.step(actions), other.step(actions)
        for one, two in zip(first, again, strict=True):
            np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(worlds.restarted, other.restarted)


def test_worlds_start_over_after_a_fall_and_at_the_end_of_an_episode() -> None:
    worlds = LeggedRobotBatch(Anymal(), 16, 0, 50)
    restarts = sum(int((worlds.step(actions), worlds.restarted)[1].sum()) for actions in 2 * _actions(60, 16))
    assert restarts >= 16
    assert np.isfinite(worlds.observations).all()
