"""Cassie on a course: obstacles are solid, attempts begin behind the last one, snapshots hold it all."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.outcome import Outcome
from pdtui.robots.cassie import Cassie
from pdtui.robots.parkour.parkour_course import HALF_WIDTH, LENGTH, SENSOR_DISTANCE
from pdtui.robots.parkour.parkour_run import ParkourRun

START = {"start": "parkour"}
STAND = np.zeros(12, np.float32)


@pytest.fixture(scope="module")
def robot() -> Cassie:
    return Cassie()


def _run(robot: Cassie) -> ParkourRun:
    assert robot.parkour is not None
    return robot.parkour


def _put(robot: Cassie, x: float, y: float = 0.0, z: float = 0.9) -> None:
    robot.data.qpos[:3], robot.data.qvel[:] = (x, y, z), 0.0


def _number(robot: Cassie, kind: str) -> int:
    return next(number for number, one in enumerate(_run(robot).course) if one.kind == kind)


def _go_to(robot: Cassie, kind: str) -> float:
    """Go on before the first obstacle of a kind and return where that is."""
    number = _number(robot, kind)
    _run(robot).progress[0] = number
    robot.reset(options=START)
    return _run(robot).course[number].place


@pytest.mark.parametrize("kind", ["gate", "bar", "opening door"])
def test_an_obstacle_stops_an_attempt_and_the_next_one_begins_before_it(robot: Cassie, kind: str) -> None:
    robot.reset(seed=1000, options=START)
    place, attempt = _go_to(robot, kind), _run(robot).attempts
    _put(robot, place)
    *_, terminated, _, info = robot.step(STAND)
    assert terminated
    assert info["outcome"] is Outcome.CRASHED
    assert info["reason"].startswith(f"crashed: ran into the {kind} at {place:.1f} m"[:-6])
    course = _run(robot).course
    robot.reset(options=START)
    assert _run(robot).course is course
    assert _run(robot).attempts == attempt + 1
    number = _number(robot, kind)
    assert robot.data.qpos[0] == pytest.approx(course[number - 1].end if number else 0.0)


def test_it_fits_through_a_gates_opening_and_under_a_bar(robot: Cassie) -> None:
    robot.reset(seed=1000, options=START)
    place = _go_to(robot, "gate")
    _put(robot, place, _run(robot).course[_number(robot, "gate")].opening)
    assert not robot.step(STAND)[2]
    _put(robot, _go_to(robot, "bar"), z=0.77)
    assert not robot.step(STAND)[2]


def test_a_door_opens_and_another_closes(robot: Cassie) -> None:
    robot.reset(seed=1000, options=START)
    for kind, there in (("closing door", False), ("opening door", True)):
        place = _go_to(robot, kind)
        boxes = _run(robot).boxes_in_the_way
        closed = (np.isclose(boxes()[:, 0], place)).any()
        assert closed == there
        for _ in range(320):  # 6.4 s
            _put(robot, place - SENSOR_DISTANCE + 0.1)
            robot.step(STAND)
        assert (np.isclose(boxes()[:, 0], place)).any() != there


def test_an_obstacle_is_passed_behind_it_and_the_course_at_its_end(robot: Cassie) -> None:
    robot.reset(seed=1001, options=START)
    for number, one in enumerate(_run(robot).course):
        _put(robot, one.end + 0.05, one.opening)
        robot.step(STAND)
        assert _run(robot).passed == number + 1
    index = robot.attribute_index("obstacles passed")
    assert robot.read_attributes()[index] == len(_run(robot).course)
    _put(robot, LENGTH + 0.1)
    *_, terminated, _, info = robot.step(STAND)
    assert (terminated, info["outcome"]) == (True, Outcome.ARRIVED)
    before = [one.place for one in _run(robot).course]
    robot.reset(options=START)  # another course
    assert [one.place for one in _run(robot).course] != before
    assert robot.data.qpos[0] == 0.0


def test_leaving_the_lane_ends_an_attempt(robot: Cassie) -> None:
    robot.reset(seed=1001, options=START)
    _put(robot, 1.0, HALF_WIDTH + 0.1)
    assert robot.step(STAND)[-1]["outcome"] is Outcome.LEFT_ROAD


def test_a_snapshot_on_a_course_restores_bit_for_bit(robot: Cassie) -> None:
    robot.reset(seed=1002, options=START)
    _go_to(robot, "opening door")
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (40, 12)).astype(np.float32)
    for action in actions[:20]:
        robot.step(action)
    snapshot = robot.snapshot()
    first = [(robot.step(action)[1], robot.digest(), robot.read_attributes().tolist()) for action in actions]
    other = Cassie()
    other.reset(seed=9)
    other.restore(snapshot)
    np.testing.assert_array_equal(other.model.geom_pos, robot.model.geom_pos)
    assert [
        (other.step(action)[1], other.digest(), other.read_attributes().tolist()) for action in actions
    ] == first


def test_off_the_course_there_is_nothing_in_the_way(robot: Cassie) -> None:
    robot.reset(seed=1000, options=START)
    assert len(robot.read_traffic().kinds) >= len(_run(robot).course)
    robot.reset(seed=1000)
    assert robot.parkour is None
    assert not robot.read_traffic().kinds
    _put(robot, 4.5)
    assert not robot.step(STAND)[2]
