"""Edits of an observation, against the observation of a robot that really is as the edit says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pdtui.robots import make_robot
from pdtui.robots.ant import Ant
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.robots.robot import Robot


def _edit(robot: Robot, name: str) -> ObservationEdit:
    return next(edit for edit in robot.observation_edits if edit.name == name)


def _walked(name: str, steps: int = 20) -> tuple[Any, np.ndarray]:
    """Return a robot that has taken some random steps, and its observation."""
    robot: Any = make_robot(name)
    robot.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(steps):
        action = 0.3 * rng.uniform(-1.0, 1.0, robot.action_space.shape).astype(np.float32)
        observation = robot.step(action)[0]
    return robot, np.asarray(observation, np.float64)


def _turn_ant(robot: Any, angle: float) -> np.ndarray:
    """Turn the Ant and its velocity about the vertical, and return what it observes."""
    qpos, qvel = robot.data.qpos.copy(), robot.data.qvel.copy()
    w, x, y, z = qpos[3:7]
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    qpos[3:7] = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    qvel[:2] = rotation @ qvel[:2]
    robot.set_state(qpos, qvel)
    return np.asarray(robot.observe())


@pytest.mark.parametrize("angle", [0.7, -2.5])
def test_an_edit_turns_the_ant_as_turning_it_does(angle: float) -> None:
    robot, observation = _walked("ant")
    edited = _edit(robot, "heading offset").apply(observation, angle)
    np.testing.assert_allclose(edited, _turn_ant(robot, angle), atol=1e-9)


def test_an_edit_sets_the_heading_of_the_ant() -> None:
    robot, observation = _walked("ant")
    edited = _edit(robot, "heading").apply(observation, 1.2)
    np.testing.assert_allclose(edited, _turn_ant(robot, 1.2 - robot.read_attributes()[3]), atol=1e-9)
    assert robot.read_attributes()[3] == pytest.approx(1.2)


def test_edits_leave_the_observation_that_they_are_given() -> None:
    for name in ("ant", "walker", "anymal", "cassie"):
        robot, observation = _walked(name, 2)
        before = observation.copy()
        for edit in robot.observation_edits:
            assert not np.array_equal(edit.apply(observation, 0.37), before), (name, edit.name)
            np.testing.assert_array_equal(observation, before)


@pytest.mark.parametrize(("edit", "coordinate"), [("height offset", 1), ("pitch offset", 2)])
def test_edits_of_the_walkers_posture(edit: str, coordinate: int) -> None:
    robot, observation = _walked("walker")
    edited = _edit(robot, edit).apply(observation, 0.05)
    robot.data.qpos[coordinate] += 0.05
    np.testing.assert_allclose(edited, robot.observe(), atol=1e-9)


def test_edits_of_the_walkers_speed() -> None:
    robot, observation = _walked("walker")
    faster, fixed = (_edit(robot, name).apply(observation, 1.5) for name in ("speed offset", "vx"))
    robot.data.qvel[0] += 1.5
    np.testing.assert_allclose(faster, robot.observe(), atol=1e-9)
    robot.data.qvel[0] = 1.5
    np.testing.assert_allclose(fixed, robot.observe(), atol=1e-9)


@pytest.mark.parametrize("name", ["anymal", "cassie"])
def test_edits_of_a_legged_robots_motion(name: str) -> None:
    robot, observation = _walked(name)
    yaw_rate = _edit(robot, "yaw rate offset").apply(observation, 0.6)
    robot.data.qvel[5] += 0.6
    np.testing.assert_allclose(yaw_rate, robot.observe(), atol=1e-6)
    robot.data.qvel[5] -= 0.6
    higher = _edit(robot, "height offset").apply(observation, 0.1)
    robot.data.qpos[2] += 0.1
    np.testing.assert_allclose(higher, robot.observe(), atol=1e-6)


@pytest.mark.parametrize(("name", "joint", "place"), [("anymal", "LF thigh", 1), ("cassie", "left knee", 3)])
def test_edits_of_a_legged_robots_joints(name: str, joint: str, place: int) -> None:
    robot, observation = _walked(name)
    bent = _edit(robot, f"{joint} offset").apply(observation, -0.2)
    robot.data.qpos[7 + place] -= 0.2
    np.testing.assert_allclose(bent, robot.observe(), atol=1e-6)


@pytest.mark.parametrize(("edit", "axis"), [("roll offset", 0), ("pitch offset", 1)])
def test_edits_lean_a_legged_robot_as_leaning_it_does(edit: str, axis: int) -> None:
    robot, observation = _walked("cassie")
    leaning = _edit(robot, edit).apply(observation, 0.15)
    w, x, y, z = robot.data.qpos[3:7].copy()
    c, s = math.cos(0.075), math.sin(0.075)
    turned = ((c * w - s * x, c * x + s * w, c * y + s * z, c * z - s * y),
              (c * w - s * y, c * x - s * z, c * y + s * w, c * z + s * x))  # fmt: skip
    robot.data.qpos[3:7] = turned[axis]
    gravity = slice(7, 10)
    np.testing.assert_allclose(leaning[gravity], robot.observe()[gravity], atol=1e-6)
    assert leaning[10:] == pytest.approx(observation[10:])


def test_a_gain_makes_a_legged_robot_see_its_drift_larger() -> None:
    robot, observation = _walked("cassie")
    more, up = _edit(robot, "sideways gain"), _edit(robot, "upward offset")
    assert more.apply(observation, 2.0)[2] == pytest.approx(3.0 * observation[2])
    assert up.apply(observation, 0.1)[3] - observation[3] == pytest.approx(0.2)  # velocities are doubled


def test_edits_of_anymals_commands() -> None:
    robot, observation = _walked("anymal")
    asked = _edit(robot, "yaw rate command").apply(observation, -0.8)
    robot.set_commands({**robot.commands, "yaw rate": -0.8})
    np.testing.assert_allclose(asked, robot.observe(), atol=1e-6)


def test_edits_of_the_a1_move_yaw_and_displacements_together() -> None:
    robot, observation = _walked("a1", 8)
    yaw = robot.attribute_index("yaw")
    assert observation[11] == pytest.approx(robot.read_attributes()[yaw], abs=0.05)  # it is 2 ms old
    turned = _edit(robot, "heading offset").apply(observation, 0.5)
    for place in (11, 15, 19):
        assert turned[place] == pytest.approx(observation[place] + 0.5)
    for place in (0, 3, 6):
        here, there = complex(*observation[place : place + 2]), complex(*turned[place : place + 2])
        assert there == pytest.approx(here * np.exp(0.5j))
    faster = _edit(robot, "speed offset").apply(observation, 2.0)
    moved = faster[:2] - observation[:2]
    assert np.hypot(*moved) == pytest.approx(2.0 * robot.control_dt)
    assert math.atan2(moved[1], moved[0]) == pytest.approx(observation[11])
    untouched = [place for place in range(93) if place not in (0, 1, 3, 4, 6, 7)]
    np.testing.assert_array_equal(faster[untouched], observation[untouched])


def test_a_quaternion_is_the_same_after_two_turns_and_not_after_one() -> None:
    robot, observation = _walked("ant")
    offset = _edit(robot, "heading offset")
    np.testing.assert_allclose(offset.apply(observation, 0.4 + 4 * np.pi), offset.apply(observation, 0.4))
    once = offset.apply(observation, 0.4 + 2 * np.pi)
    np.testing.assert_allclose(once[1:5], -offset.apply(observation, 0.4)[1:5])
    np.testing.assert_allclose(once[5:], offset.apply(observation, 0.4)[5:], atol=1e-12)
    for size in (5.0, -6.0, 7.0, 21.25, -21.25):
        short = offset.wrap_size(size)
        assert abs(short) <= 2 * np.pi
        np.testing.assert_allclose(offset.apply(observation, short), offset.apply(observation, size))


def test_a_heading_is_set_in_the_same_way_however_often_the_robot_has_turned() -> None:
    robot, observation = _walked("ant")
    turned = _edit(robot, "heading offset").apply(observation, 2 * np.pi)
    heading = _edit(robot, "heading")
    np.testing.assert_allclose(heading.apply(turned, 0.5), heading.apply(observation, 0.5), atol=1e-9)


@pytest.mark.parametrize("turns", [-2.8, -0.9, 0.3, 1.1, 2.6])
def test_whole_turns_make_no_difference_to_a_canonical_quaternion(turns: float) -> None:
    usual, observation = _walked("ant")
    robot: Any = Ant(canonical_quaternion=True)
    robot.restore(usual.snapshot())
    offset, heading = _edit(robot, "heading offset"), _edit(robot, "heading")
    size = 2 * np.pi * turns
    edited = offset.apply(robot.observe(), size)
    np.testing.assert_allclose(edited, offset.apply(robot.observe(), size + 2 * np.pi), atol=1e-9)
    assert abs(offset.wrap_size(size)) <= np.pi
    np.testing.assert_allclose(edited, offset.apply(robot.observe(), offset.wrap_size(size)), atol=1e-9)
    there = _turn_ant(robot, size)
    np.testing.assert_allclose(edited, there, atol=1e-9)
    # It is the usual observation, or that with the quaternion's negative, and its w is not negative.
    expected = _turn_ant(usual, size)
    np.testing.assert_allclose(there[1:5] * np.sign(expected[1]), expected[1:5], atol=1e-12)
    np.testing.assert_array_equal(np.delete(there, range(1, 5)), np.delete(expected, range(1, 5)))
    assert there[1] >= 0.0
    np.testing.assert_allclose(heading.apply(there, 0.5), heading.apply(observation, 0.5), atol=1e-9)


def test_an_angle_is_the_same_after_one_turn_and_a_length_never() -> None:
    pytest.importorskip("pybullet", reason="PyBullet has no wheels for every Python")
    robot, _ = _walked("a1", 4)
    assert _edit(robot, "heading offset").wrap_size(7.0) == pytest.approx(7.0 - 2 * np.pi)
    assert _edit(robot, "speed offset").wrap_size(7.0) == 7.0
