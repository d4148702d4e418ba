"""Cassie: the paper's policy walks in it, it observes the ground, and snapshots are bit-exact on it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.robots.cassie import Cassie
from pdtui.robots.legged.observations_and_rewards import COMMAND_SCALES

WEIGHTS = Path(__file__).parents[3] / "shared" / "reference" / "forward_cassie_elu.npz"


def _actions(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 12)).astype(np.float32)


def _value(robot: Cassie, name: str) -> float:
    return float(robot.read_attributes()[robot.attribute_index(name)])


@pytest.fixture(params=["plane", "rough"])
def cassie(request: pytest.FixtureRequest) -> Cassie:
    robot = Cassie(terrain=request.param)
    robot.reset(seed=5)
    return robot


@pytest.mark.skipif(not WEIGHTS.is_file(), reason="the paper authors' weights (../shared) are not here")
@pytest.mark.parametrize(("observed", "speed"), [(1.0, 0.61), (2.0, 1.13), (4.0, 2.07)])
def test_the_authors_policy_walks_as_fast_as_measured(observed: float, speed: float) -> None:
    robot, policy = Cassie(), load_policy(WEIGHTS, import_options=ImportOptions("elu"))
    robot.reset(seed=1)
    robot.set_commands({"forward": observed / COMMAND_SCALES[0], "heading": 0.0})
    observation, speeds = robot.observe(), []
    for _ in range(1000):
        observation, _, fell, _, _ = robot.step(policy.act(observation).action)
        assert not fell
        speeds.append(_value(robot, "speed"))
    assert np.mean(speeds[100:]) == pytest.approx(speed, abs=0.06)
    assert abs(_value(robot, "yaw")) < 0.4  # it sways


@pytest.mark.parametrize("command", [0.5, 1.5])
def test_the_shipped_policy_walks_on_rough_ground_as_fast_as_it_is_told(command: float) -> None:
    robot, policy = Cassie(terrain="rough"), load_policy("cassie")
    robot.reset(seed=100)
    robot.set_commands({"forward": command, "heading": 0.0})
    observation, speeds = robot.observe(), []
    for _ in range(400):
        observation, _, terminated, _, _ = robot.step(policy.act(observation).action)
        assert not terminated
        speeds.append(_value(robot, "forward"))
    assert np.mean(speeds[150:]) == pytest.approx(command, abs=0.2)
    assert abs(_value(robot, "yaw")) < 0.5


def test_it_weighs_what_the_figures_say_and_stands_on_its_toes(cassie: Cassie) -> None:
    assert cassie.model.body_mass.sum() == pytest.approx(30.37, abs=0.01)
    for _ in range(15):
        assert not cassie.step(np.zeros(12, np.float32))[2]
    assert _value(cassie, "left contact") == _value(cassie, "right contact") == 1.0
    assert _value(cassie, "left foot height") == pytest.approx(0.03, abs=0.03)
    assert 0.6 < _value(cassie, "height") < 0.9  # it drops from 1 m and bends its knees


def test_it_falls_when_the_pelvis_touches_the_ground(cassie: Cassie) -> None:
    for _ in range(200):
        *_, info = cassie.step(np.zeros(12, np.float32))  # it cannot stand without balancing
        if info.get("reason"):
            break
    assert info["reason"].startswith("fell: trunk at 0.2")


def test_a_snapshot_restores_bit_for_bit_with_its_ground(cassie: Cassie) -> None:
    for action in _actions(20):
        cassie.step(action)
    snapshot, rest = cassie.snapshot(), _actions(20, 1)
    first = [(cassie.step(action)[1], cassie.digest(), cassie.observe().tolist()) for action in rest]
    other = Cassie()
    other.reset(seed=9)
    other.restore(snapshot)
    assert [(other.step(action)[1], other.digest(), other.observe().tolist()) for action in rest] == first


def test_an_observation_has_its_parts_in_their_places() -> None:
    robot = Cassie()
    robot.reset(seed=5)
    robot.step(np.full(12, 0.3, np.float32))
    robot.set_commands({"forward": 0.5, "heading": 1.0})
    seen, data = robot.observe(), robot.data
    rotation = data.body("pelvis").xmat.reshape(3, 3)
    assert seen.shape == robot.observation_space.shape == (170,)
    assert seen[0] == data.qpos[2]
    np.testing.assert_allclose(seen[1:4], 2.0 * rotation.T @ data.qvel[:3], atol=2e-2)
    np.testing.assert_allclose(seen[7:10], -rotation[2], atol=2e-2)
    yaw_rate = 0.5 * (1.0 - _value(robot, "yaw"))
    np.testing.assert_allclose(seen[10:13], COMMAND_SCALES * [0.5, 0.0, yaw_rate])
    np.testing.assert_allclose(seen[13:25], data.qpos[7:] - robot.description.stance)
    np.testing.assert_allclose(seen[37:49], 0.3, rtol=1e-6)
    np.testing.assert_allclose(seen[49:], 5.0 * (data.qpos[2] - 0.5))
    robot.set_commands({"forward": 0.5, "heading": -3.0})
    assert robot.observe()[12] == -0.25  # the yaw rate is at most 1 rad/s


def test_it_observes_the_ground_around_it_in_the_direction_of_its_heading() -> None:
    robot = Cassie(terrain="rough", roughness=0.2)
    robot.reset(seed=2)
    yaw = 0.7
    robot.data.qpos[:2] = 5.0, -3.0
    robot.data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
    assert robot.ground is not None
    ahead, left = 0.3, -0.2  # the point in row 8 and column 3
    x = 5.0 + math.cos(yaw) * ahead - math.sin(yaw) * left
    y = -3.0 + math.sin(yaw) * ahead + math.cos(yaw) * left
    below = robot.data.qpos[2] - robot.ground.height(x, y)
    assert robot.observe()[49 + 8 * 11 + 3] == pytest.approx(5.0 * (below - 0.5))


def test_the_simulators_ground_is_the_one_that_is_observed() -> None:
    import mujoco

    robot = Cassie(terrain="rough", roughness=0.2)
    robot.reset(seed=2)
    ground, geom = robot.ground, np.zeros(1, np.int32)
    assert ground is not None
    for x, y in ((0.25, 0.25), (7.5, -4.25), (41.75, 8.0)):  # heights of the grid
        down = np.array([0.0, 0.0, -1.0])
        distance = mujoco.mj_ray(robot.model, robot.data, np.array([x, y, 3.0]), down, None, 1, -1, geom)
        assert 3.0 - distance == pytest.approx(ground.height(x, y), abs=1e-5)


def test_the_ground_is_a_function_of_the_seed() -> None:
    robot = Cassie(terrain="rough")
    grounds = []
    for seed in (3, 4, 3):
        robot.reset(seed=seed)
        assert robot.ground is not None
        grounds.append(robot.ground.heights)
    np.testing.assert_array_equal(grounds[0], grounds[2])
    assert not np.array_equal(grounds[0], grounds[1])
    robot.reset(seed=3, options={"start": "plane"})
    assert robot.ground is None
    assert not robot.model.hfield_data.any()


def test_the_pelvis_pitch_goes_on_beyond_a_right_angle() -> None:
    robot = Cassie()
    robot.reset(seed=0)
    for angle in (-2.5, 0.4, 2.5):
        robot.data.qpos[3:7] = math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0
        assert _value(robot, "pelvis pitch") == pytest.approx(angle)


def test_terrains_that_it_does_not_have_are_named() -> None:
    with pytest.raises(RobotError, match="terrain"):
        make_robot("cassie", terrain="ice")
    with pytest.raises(RobotError, match="no start 'ice'; available: plane, rough"):
        Cassie().reset(seed=0, options={"start": "ice"})
