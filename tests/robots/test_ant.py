"""The Ant: stock physics, named attributes, bit-exact snapshots."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pdtui.core.attributes import wrap_angle
from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.robots import make_robot
from pdtui.robots.ant import Ant
from pdtui.robots.geometry import capsule_ends, compute_link_poses


def _actions(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 8)).astype(np.float32)


def _digests(robot: Ant, actions: np.ndarray) -> list[int]:
    digests = []
    for action in actions:
        robot.step(action)
        digests.append(robot.digest())
    return digests


@pytest.fixture
def ant() -> Ant:
    robot = Ant()
    robot.reset(seed=5)
    return robot


def test_physics_is_that_of_stock_ant(ant: Ant) -> None:
    stock: Any = gymnasium.make("Ant-v5", include_cfrc_ext_in_observation=False).unwrapped
    stock.reset(seed=0)
    stock.set_state(ant.data.qpos.copy(), ant.data.qvel.copy())
    for action in _actions(50):
        ours, theirs = ant.step(action), stock.step(action)
        np.testing.assert_allclose(ours[0], theirs[0], rtol=0, atol=1e-9)


def test_reward_is_forward_along_either_axis(ant: Ant) -> None:
    before = ant.data.qpos[:2].copy()
    action = _actions(1)[0]
    _, reward, _, _, info = ant.step(action)
    velocity = (ant.data.qpos[:2] - before) / 0.05
    assert info["reward_forward"] == pytest.approx(np.abs(velocity).max())
    costs = info["reward_ctrl"] + info["reward_contact"]
    assert reward == pytest.approx(info["reward_forward"] + info["reward_survive"] + costs)
    assert info["cost"] == 0.0


def test_headings_at_reset_fill_the_circle() -> None:
    robot = Ant()
    yaw = robot.attribute_index("yaw")
    robot.reset(seed=0)
    headings = []
    for _ in range(200):
        robot.reset()
        headings.append(robot.read_attributes()[yaw])
    counts, _ = np.histogram(headings, bins=4, range=(-np.pi, np.pi))
    assert counts.min() > 30


def test_attributes_agree_with_an_independent_computation(ant: Ant) -> None:
    for action in _actions(20):
        ant.step(action)
    values = dict(zip([a.name for a in ant.attributes], ant.read_attributes(), strict=True))
    rotation = Rotation.from_quat(ant.data.qpos[[4, 5, 6, 3]])
    yaw, pitch, roll = rotation.as_euler("ZYX")
    assert values["yaw"] == pytest.approx(yaw)
    assert values["pitch"] == pytest.approx(pitch)
    assert values["roll"] == pytest.approx(roll)
    assert values["yaw rate"] == pytest.approx(rotation.apply(ant.data.qvel[3:6])[2])
    assert values["speed"] == pytest.approx(np.hypot(values["vx"], values["vy"]))
    assert values["height"] == ant.data.qpos[2]
    torques = [value for name, value in values.items() if name.endswith("torque")]
    np.testing.assert_allclose(torques, ant.data.actuator_force * 150.0)


def test_links_lie_where_mujoco_puts_the_geoms(ant: Ant) -> None:
    for action in _actions(10):
        ant.step(action)
    placed = compute_link_poses(ant.links, ant.read_poses())
    geoms = [index for index in range(ant.model.ngeom) if ant.model.geom(index).bodyid[0] != 0]
    np.testing.assert_allclose(placed[:, :3], ant.data.geom_xpos[geoms], atol=1e-12)
    ends = capsule_ends(ant.links, placed)
    for row, geom in enumerate(geoms):
        axis = ant.data.geom_xmat[geom].reshape(3, 3)[:, 2] * ant.model.geom_size[geom][1]
        if ant.links[row].shape == "capsule":
            np.testing.assert_allclose(ends[row, 1] - ends[row, 0], 2 * axis, atol=1e-12)


def test_snapshot_restores_bit_exactly_into_this_and_another_robot(ant: Ant) -> None:
    for action in _actions(30, seed=1):
        ant.step(action)
    snapshot = ant.snapshot()
    first = _digests(ant, _actions(100, seed=2))
    ant.restore(snapshot)
    assert _digests(ant, _actions(100, seed=2)) == first
    other = Ant()
    other.reset(seed=99)
    other.restore(snapshot)
    assert _digests(other, _actions(100, seed=2)) == first
    ant.restore(snapshot)
    other.restore(snapshot)
    np.testing.assert_array_equal(ant.reset()[0], other.reset()[0])


def test_digest_sees_the_last_bit(ant: Ant) -> None:
    before = ant.digest()
    ant.data.qpos[0] = np.nextafter(ant.data.qpos[0], np.inf)
    assert ant.digest() != before


def test_snapshot_of_another_size_is_refused(ant: Ant) -> None:
    from dataclasses import replace

    broken = replace(ant.snapshot(), state=np.zeros(3))
    with pytest.raises(RobotError, match="ant: expected a state of .* numbers, got 3"):
        ant.restore(broken)


def test_lying_on_the_back_ends_the_episode(ant: Ant) -> None:
    qpos = ant.data.qpos.copy()
    qpos[3:7] = 0, 1, 0, 0
    ant.set_state(qpos, np.zeros(14))
    _, _, terminated, _, info = ant.step(np.zeros(8, np.float32))
    assert terminated
    assert info["reason"] == "fell: on its back"


def test_divergence_is_an_error_that_says_when(ant: Ant) -> None:
    ant.set_state(ant.data.qpos.copy(), np.full(14, 1e9))
    with pytest.raises(SimulationDiverged, match="ant: the simulation diverged at"):
        for action in _actions(20):
            ant.step(action)


def test_unknown_robot_lists_the_known_ones() -> None:
    with pytest.raises(RobotError, match="unknown robot 'qqqqqqqq'; available: a1, a1-vision"):
        make_robot("qqqqqqqq")


def test_wrap_angle() -> None:
    assert wrap_angle(np.pi) == np.pi
    assert wrap_angle(-np.pi) == np.pi
    assert wrap_angle(3 * np.pi + 0.1) == pytest.approx(-np.pi + 0.1)
