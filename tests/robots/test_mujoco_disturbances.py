"""Friction, masses and pushes of robots on MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.mujoco_disturbances import (
    offers_pushes,
    offers_scaled_physics,
    push_trunk,
    scaled_physics,
)
from tests.turning_robot import Vehicle


def _drive(robot: Robot, steps: int = 30) -> list[int]:
    robot.reset(seed=3)
    rng = np.random.default_rng(3)
    digests = []
    for _ in range(steps):
        robot.step(rng.uniform(-0.5, 0.5, robot.action_space.shape or (1,)).astype(np.float32))
        digests.append(robot.digest())
    return digests


@pytest.mark.parametrize("name", ["ant", "walker", "anymal", "HalfCheetah-v5"])
def test_scaled_physics_changes_the_drive_and_leaves_no_trace(name: str) -> None:
    robot = make_robot(name)
    assert offers_scaled_physics(robot)
    usual = _drive(robot)
    for friction, mass in ((0.5, 1.0), (1.0, 1.2)):
        with scaled_physics(robot, friction, mass):
            assert _drive(robot) != usual
        assert _drive(robot) == usual


def test_masses_are_scaled_with_everything_that_follows_from_them() -> None:
    robot = make_robot("ant")
    own = robot.model.body_subtreemass[0]  # type: ignore[attr-defined]
    with scaled_physics(robot, 1.0, 1.2):
        assert robot.model.body_subtreemass[0] == pytest.approx(1.2 * own)  # type: ignore[attr-defined]
    assert robot.model.body_subtreemass[0] == own  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["ant", "anymal", "walker", "HalfCheetah-v5"])
def test_a_push_changes_the_velocity_of_the_trunk_by_as_much(name: str) -> None:
    robot = make_robot(name)
    robot.reset(seed=1)
    before = robot.read_attributes()[robot.attribute_index("vx")]
    push_trunk(robot, 0.7, -0.4)
    assert robot.read_attributes()[robot.attribute_index("vx")] == pytest.approx(before + 0.7)


def test_other_robots_refuse() -> None:
    vehicle, pusher = Vehicle(), make_robot("Pusher-v5")
    assert not offers_scaled_physics(vehicle)
    assert not offers_pushes(vehicle)
    assert offers_scaled_physics(pusher)
    assert not offers_pushes(pusher)  # its arm is bolted to the ground; only things around it slide
    with pytest.raises(RobotError, match="vehicle: not on MuJoCo, or its trunk cannot move"):
        push_trunk(vehicle, 1.0, 0.0)
    with (
        pytest.raises(RobotError, match="vehicle: expected a robot on MuJoCo"),
        scaled_physics(vehicle, 1, 2),
    ):
        pass
