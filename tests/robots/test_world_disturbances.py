"""Friction, masses and pushes of robots on each simulator."""

from __future__ import annotations

import threading
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from tests.turning_robot import Vehicle

NEEDS_BULLET = pytest.mark.skipif(find_spec("pybullet") is None, reason="PyBullet is not installed")
ROBOTS = [
    *("ant", "walker", "anymal", "cassie", "HalfCheetah-v5", "bipedal_walker"),
    pytest.param("a1", marks=NEEDS_BULLET),
]


def _drive(robot: Robot, steps: int = 30, start: str = "") -> list[int]:
    robot.reset(seed=3, options={"start": start} if start else None)
    rng = np.random.default_rng(3)
    return [_step(robot, rng.uniform(-0.5, 0.5, robot.action_space.shape or (1,))) for _ in range(steps)]


def _step(robot: Robot, action: Any) -> int:
    robot.step(action.astype(np.float32))
    return robot.digest()


def _value(robot: Robot, name: str) -> float:
    return float(robot.read_attributes()[robot.attribute_index(name)])


@pytest.mark.parametrize("name", ROBOTS)
def test_scaled_physics_changes_the_drive_and_leaves_no_trace(name: str) -> None:
    robot = make_robot(name)
    assert robot.offers_scaled_physics
    usual = _drive(robot)
    for friction, mass in ((0.5, 1.0), (1.0, 1.2)):
        with robot.scaled_physics(friction, mass):
            disturbed = _drive(robot)
            assert disturbed != usual
            assert _drive(robot) == disturbed
        assert _drive(robot) == usual
        with pytest.raises(KeyError), robot.scaled_physics(friction, mass):
            raise KeyError
        assert _drive(robot) == usual


@pytest.mark.parametrize(
    ("name", "start"), [("bipedal_walker", "split"), pytest.param("a1", "forest", marks=NEEDS_BULLET)]
)
def test_other_starts_are_scaled_too(name: str, start: str) -> None:
    robot = make_robot(name)
    usual = _drive(robot, 10, start)
    with robot.scaled_physics(1.0, 1.2):
        assert _drive(robot, 10, start) != usual
    assert _drive(robot, 10, start) == usual


def _mujoco_mass(robot: Any) -> tuple[float, float]:
    return float(robot.model.body_subtreemass[0]), float(robot.model.body_inertia.sum())


def _bullet_mass(robot: Any) -> tuple[float, float]:
    bullet, body = robot.bullet, robot.robot_id
    known = [bullet.getDynamicsInfo(body, link) for link in range(-1, bullet.getNumJoints(body))]
    return sum(one[0] for one in known), float(np.sum([one[2] for one in known]))


def _box2d_mass(robot: Any) -> tuple[float, float]:
    bodies = (robot.world.hull, *robot.world.legs)
    return sum(body.mass for body in bodies), sum(body.inertia for body in bodies)


MASSES: list[Any] = [
    ("ant", _mujoco_mass),
    ("bipedal_walker", _box2d_mass),
    pytest.param("a1", _bullet_mass, marks=NEEDS_BULLET),
]


@pytest.mark.parametrize(("name", "weigh"), MASSES)
def test_masses_and_inertias_are_scaled(name: str, weigh: Callable[[Any], tuple[float, float]]) -> None:
    robot = make_robot(name)
    robot.reset(seed=1)
    own = weigh(robot)
    with robot.scaled_physics(1.0, 1.2):
        robot.reset(seed=1)
        assert weigh(robot) == pytest.approx([1.2 * value for value in own])
    robot.reset(seed=1)
    assert weigh(robot) == own


@NEEDS_BULLET
@pytest.mark.parametrize("start", ["plane", "rough", "forest"])
def test_bullets_product_of_two_frictions_is_scaled(start: str) -> None:
    robot: Any = make_robot("a1")

    def products() -> np.ndarray:
        robot.reset(seed=2, options={"start": start})
        bullet, toe = robot.bullet, robot.bullet.getDynamicsInfo(robot.robot_id, 5)
        others = [bullet.getDynamicsInfo(body, -1) for body in range(robot.robot_id)]
        # Bullet multiplies rolling friction with the other body's lateral friction.
        return np.array([(toe[1] * one[1], toe[1] * one[6] + toe[6] * one[1]) for one in others])

    own = products()
    with robot.scaled_physics(0.8, 1.0):
        assert products() == pytest.approx(0.8 * own)
    assert (products() == own).all()
    assert {"plane": 1, "rough": 2}.get(start, 20) <= len(own)


def test_box2ds_mean_of_two_frictions_is_scaled() -> None:
    robot: Any = make_robot("bipedal_walker")

    def contact_frictions() -> list[float]:
        robot.reset(seed=2)
        for _ in range(20):
            robot.step(np.zeros(4, np.float32))
        return [contact.friction for contact in robot.world.world.contacts if contact.touching]

    own = contact_frictions()
    assert own
    with robot.scaled_physics(0.8, 1.0):
        assert contact_frictions()[:1] == pytest.approx([0.8 * own[0]])


@pytest.mark.parametrize("name", ROBOTS)
def test_a_push_changes_the_velocity_of_the_trunk_by_as_much(name: str) -> None:
    robot = make_robot(name)
    _drive(robot, 5)
    before = {one: _value(robot, one) for one in ("vx", "vy") if one in _names(robot)}
    robot.push_trunk(0.7, -0.4)
    assert robot.offers_pushes
    assert _value(robot, "vx") == pytest.approx(before["vx"] + 0.7)
    if "vy" in before:
        assert _value(robot, "vy") == pytest.approx(before["vy"] - 0.4)
    assert {"ant": "vy", "anymal": "vy", "cassie": "vy", "a1": "vy"}.get(name, "vx") in before


def _names(robot: Robot) -> list[str]:
    return [attribute.name for attribute in robot.attributes]


def test_a_push_takes_the_whole_bipedal_walker_along() -> None:
    robot: Any = make_robot("bipedal_walker")
    _drive(robot, 5)
    robot.push_trunk(0.7, 0.0)
    moved = [body.linearVelocity.x for body in (robot.world.hull, *robot.world.legs)]
    _drive(robot, 5)
    own = [body.linearVelocity.x for body in (robot.world.hull, *robot.world.legs)]
    assert moved == pytest.approx([vx + 0.7 for vx in own], abs=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_snapshots_hold_pushes_and_scaled_worlds(name: str) -> None:
    robot = make_robot(name)
    with robot.scaled_physics(0.8, 1.2):
        _drive(robot, 5)
        robot.push_trunk(0.7, -0.4)
        action = np.zeros(robot.action_space.shape or (1,))
        pushed = _step(robot, action)
        robot.push_trunk(-0.3, 0.2)
        snapshot = robot.snapshot()
        rest = [_step(robot, action) for _ in range(5)]
        assert rest[0] != pushed
        _drive(robot, 3)
        robot.restore(snapshot)
        assert [_step(robot, action) for _ in range(5)] == rest


@NEEDS_BULLET
def test_a_restored_snapshot_brings_back_the_robots_own_world() -> None:
    robot = make_robot("a1")
    _drive(robot, 5)
    snapshot, action = robot.snapshot(), np.zeros(6)
    usual = [_step(robot, action) for _ in range(5)]
    with robot.scaled_physics(0.5, 2.0):
        _drive(robot, 5)  # of the same seed, so that only the factors differ
    robot.restore(snapshot)
    assert [_step(robot, action) for _ in range(5)] == usual


def test_an_environment_that_every_reset_makes_anew_is_scaled() -> None:
    robot: Any = make_robot("HalfCheetah-v5")
    robot.world.lock = threading.Lock()  # cannot be copied, so snapshots repeat actions in a new environment
    usual = _drive(robot, 10)
    with robot.scaled_physics(1.0, 1.2):
        assert _drive(robot, 10) != usual
        robot.push_trunk(0.5, 0.0)
        snapshot, vx = robot.snapshot(), robot.read_attributes()
        robot.reset(seed=1)
        robot.restore(snapshot)
        assert (robot.read_attributes() == vx).all()
    assert _drive(robot, 10) == usual


def test_other_robots_refuse() -> None:
    vehicle, pusher = Vehicle(), make_robot("Pusher-v5")
    assert not vehicle.offers_scaled_physics
    assert not vehicle.offers_pushes
    assert pusher.offers_scaled_physics
    assert not pusher.offers_pushes  # its arm is bolted to the ground; only things around it slide
    for robot in (vehicle, pusher):
        with pytest.raises(RobotError, match=f"{robot.name}: expected a robot whose trunk can be pushed"):
            robot.push_trunk(1.0, 0.0)
    with (
        pytest.raises(RobotError, match="vehicle: expected a robot whose friction and masses can be scaled"),
        vehicle.scaled_physics(1, 2),
    ):
        pass
