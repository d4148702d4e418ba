"""Many legged robots at once: the same motion as one alone, and a state that goes on where it was."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("jax", reason="the extra 'train' is not installed")

from pdtui.robots.anymal import Anymal, AnymalForward
from pdtui.training.legged_robot_batch import LeggedRobotBatch


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


def test_a_restored_state_goes_on_the_same() -> None:
    worlds, other = (LeggedRobotBatch(AnymalForward(), 6, 0, 40), LeggedRobotBatch(AnymalForward(), 6, 9, 40))
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
