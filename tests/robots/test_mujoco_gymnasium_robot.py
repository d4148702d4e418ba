"""Environments on MuJoCo: the environment's own steps, attributes of the model, bit-exact snapshots."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.robots import make_robot
from pdtui.robots.geometry import capsule_ends, compute_link_poses
from pdtui.robots.robot import Robot
from tests.robots.wrapped_environments import follow, random_actions, values_of

STOCK = (
    "Hopper-v5",
    "HalfCheetah-v5",
    "Walker2d-v5",
    "Ant-v5",
    "Humanoid-v5",
    "InvertedPendulum-v5",
    "Swimmer-v5",
    "Reacher-v5",
    "Pusher-v5",
)


@pytest.mark.parametrize("name", STOCK)
def test_a_snapshot_restores_bit_exactly_into_this_and_another_robot(name: str) -> None:
    robot, actions = make_robot(name), random_actions(name, 40)
    robot.reset(seed=3)
    follow(robot, actions[:7])
    snapshot = robot.snapshot()
    observation = robot.observe().copy()
    first = follow(robot, actions[7:])
    robot.restore(snapshot)
    np.testing.assert_array_equal(robot.observe(), observation)
    assert follow(robot, actions[7:]) == first
    other = make_robot(name)
    other.restore(snapshot)
    assert follow(other, actions[7:]) == first


@pytest.mark.parametrize("name", STOCK)
def test_steps_are_those_of_the_environment(name: str) -> None:
    """Reading attributes and poses between steps must change nothing: Ant's reward, say, reads old poses."""
    robot, actions = make_robot(name), random_actions(name, 20)
    stock: gymnasium.Env[Any, Any] = gymnasium.make(name)
    np.testing.assert_array_equal(robot.reset(seed=5)[0], stock.reset(seed=5)[0])
    for action in actions:
        ours, theirs = robot.step(action), stock.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:3] == theirs[1:3]
        robot.read_attributes()
        robot.read_poses()
        if ours[2]:
            break


def test_a_time_limit_does_not_end_an_episode() -> None:
    robot = make_robot("Reacher-v5")  # 50 steps by its registration
    robot.reset(seed=0)
    assert not any(robot.step(action)[3] for action in random_actions("Reacher-v5", 60))


def test_a_planar_walker_has_its_planes_attributes() -> None:
    robot: Any = make_robot("Hopper-v5")
    robot.reset(seed=1)
    follow(robot, random_actions("Hopper-v5", 5))
    values, qpos, qvel = values_of(robot), robot.world.data.qpos, robot.world.data.qvel
    assert values["height"] == pytest.approx(qpos[1])
    assert values["vx"] == qvel[0]
    assert values["speed"] == abs(qvel[0])
    assert values["pitch rate"] == qvel[2]
    assert values["thigh angle"] == qpos[3]
    assert values["foot velocity"] == qvel[5]
    assert values["leg torque"] == pytest.approx(robot.world.data.ctrl[1] * 200.0)
    assert values["reward"] == robot.reward
    assert not {"vy", "yaw", "roll"} & values.keys()
    units = {attribute.name: (attribute.unit, attribute.scale) for attribute in robot.attributes}
    assert units["leg torque"] == ("N m", 1 / 200.0)
    assert units["pitch"] == ("rad", 1.0)


def test_height_counts_from_the_ground_whatever_the_joint_counts_from() -> None:
    robot: Any = make_robot("HalfCheetah-v5")
    robot.reset(seed=1)
    follow(robot, random_actions("HalfCheetah-v5", 5))
    assert values_of(robot)["height"] == pytest.approx(robot.read_poses()[0, 2])


def test_a_free_body_has_all_attributes() -> None:
    robot: Any = make_robot("Ant-v5")
    robot.reset(seed=1)
    follow(robot, random_actions("Ant-v5", 20))
    values, data = values_of(robot), robot.world.data
    rotation = Rotation.from_quat(data.qpos[[4, 5, 6, 3]])
    expected = dict(zip(("yaw", "pitch", "roll"), rotation.as_euler("ZYX"), strict=True))
    expected["yaw rate"] = rotation.apply(data.qvel[3:6])[2]
    expected["speed"] = np.hypot(*data.qvel[:2])
    expected["height"] = data.qpos[2]
    for name, value in expected.items():
        assert values[name] == pytest.approx(value), name


def test_an_arm_without_limits_has_an_angle_that_wraps() -> None:
    robot: Any = make_robot("Reacher-v5")
    robot.reset(seed=1)
    robot.world.data.qpos[0] = 2 * np.pi + 0.25
    assert values_of(robot)["joint0 angle"] == pytest.approx(0.25)
    wraps = {attribute.name for attribute in robot.attributes if attribute.wraps}
    assert wraps == {"joint0 angle"}


def test_a_cart_has_a_place_and_a_force() -> None:
    robot: Any = make_robot("InvertedPendulum-v5")
    robot.reset(seed=1)
    follow(robot, random_actions("InvertedPendulum-v5", 3))
    values = values_of(robot)
    assert values["x"] == robot.world.data.qpos[0]
    assert values["slide force"] == pytest.approx(robot.world.data.ctrl[0] * 100.0)


@pytest.mark.parametrize("name", ["Hopper-v5", "Humanoid-v5", "Pusher-v5"])
def test_shapes_lie_where_the_simulator_has_them(name: str) -> None:
    robot: Any = make_robot(name)
    robot.reset(seed=0)  # a reset leaves the simulator's kinematics up to date
    placed = compute_link_poses(robot.links, robot.read_poses())
    model, data = robot.world.model, robot.world.data
    drawn = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] and model.geom_rgba[geom, 3] > 0]
    np.testing.assert_allclose(placed[:, :3], data.geom_xpos[drawn], atol=1e-12)
    assert np.isfinite(capsule_ends(robot.links, placed)).all()


def test_a_snapshot_of_another_world_is_refused() -> None:
    hopper, walker = make_robot("Hopper-v5"), make_robot("Walker2d-v5")
    hopper.reset(seed=0)
    with pytest.raises(RobotError, match="expected a snapshot of Walker2d-v5, got one of Hopper-v5"):
        walker.restore(hopper.snapshot())


def test_divergence_is_an_error_that_says_when() -> None:
    robot: Any = make_robot("HalfCheetah-v5")
    robot.reset(seed=0)
    robot.world.data.qvel[:] = 1e9
    with pytest.raises(SimulationDiverged, match="HalfCheetah-v5: the simulation diverged at"):
        follow(robot, random_actions("HalfCheetah-v5", 20))


def test_the_digest_sees_the_last_bit() -> None:
    robot: Any = make_robot("Swimmer-v5")
    robot.reset(seed=0)
    before = robot.digest()
    robot.world.data.qpos[0] = np.nextafter(robot.world.data.qpos[0], np.inf)
    assert robot.digest() != before


def test_building_and_stepping_leaves_no_log_file(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    robot: Robot = make_robot("HalfCheetah-v5")  # its model has an attribute that MuJoCo warns of
    robot.reset(seed=0)
    assert list(tmp_path.iterdir()) == []
