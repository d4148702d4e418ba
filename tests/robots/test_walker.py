"""The Walker: stock physics, attributes that mean what they say, bit-exact snapshots."""

from __future__ import annotations

from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

from pdtui.robots.walker import Walker


def _actions(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 6)).astype(np.float32)


@pytest.fixture
def walker() -> Walker:
    robot = Walker()
    robot.reset(seed=5)
    return robot


def test_it_steps_and_pays_as_stock_walker2d_does(walker: Walker) -> None:
    stock: Any = gymnasium.make("Walker2d-v5", xml_file="walker2d.xml").unwrapped
    stock.reset(seed=5)
    for action in _actions(20):
        expected = stock.step(action)
        got = walker.step(action)
        np.testing.assert_array_equal(got[0], expected[0])
        assert got[1:3] == expected[1:3]


def test_a_snapshot_restores_bit_for_bit(walker: Walker) -> None:
    for action in _actions(10):
        walker.step(action)
    snapshot, rest = walker.snapshot(), _actions(20, 1)
    first = [(walker.step(action)[1], walker.read_attributes().tolist(), walker.digest()) for action in rest]
    other = Walker()
    other.reset(seed=9)
    other.restore(snapshot)
    again = [(other.step(action)[1], other.read_attributes().tolist(), other.digest()) for action in rest]
    assert first == again


def test_a_foot_that_touches_has_no_clearance(walker: Walker) -> None:
    """MuJoCo's own contacts are the independent measurement."""
    feet = {
        walker.model.geom(name).id: side
        for side, name in (("right", "foot_geom"), ("left", "foot_left_geom"))
    }
    agreed = touched = 0
    for action in _actions(60):
        walker.step(0.2 * action)
        clearance = {
            side: walker.read_attributes()[walker.attribute_index(f"{side} foot clearance")]
            for side in feet.values()
        }
        mujoco.mj_forward(walker.model, walker.data)
        on_ground = {
            feet[int(geom)]
            for contact in range(walker.data.ncon)
            for geom in walker.data.contact[contact].geom
            if int(geom) in feet and walker.data.contact[contact].dist < 0
        }
        for side, value in clearance.items():
            agreed += (value < 0) == (side in on_ground)
            touched += side in on_ground
    assert agreed == 120
    assert touched > 10


def test_attributes_are_the_simulators(walker: Walker) -> None:
    for action in _actions(5):
        walker.step(action)
    values = dict(zip((one.name for one in walker.attributes), walker.read_attributes(), strict=True))
    assert values["height"] == walker.data.qpos[1]
    assert values["pitch"] == pytest.approx(walker.data.qpos[2])
    assert values["vx"] == walker.data.qvel[0]
    assert values["left leg torque"] == pytest.approx(walker.data.qfrc_actuator[7])


def test_a_fall_has_its_reason(walker: Walker) -> None:
    for _ in range(500):
        _, _, ended, _, info = walker.step(np.ones(6, np.float32))
        if ended:
            break
    assert info["reason"].startswith("fell: ")


def test_training_is_paid_less_for_a_foot_that_never_lands() -> None:
    plain, alternating = Walker(), Walker(alternate=True)
    for robot in (plain, alternating):
        robot.reset(seed=0)
        # Held above the ground: both feet are in the air.
        robot.data.qpos[1] = 1.9
    pays = [[robot.step(np.zeros(6, np.float32))[1] for _ in range(20)] for robot in (plain, alternating)]
    assert pays[0] == pays[1]
    for robot in (plain, alternating):
        for _ in range(45):
            robot.data.qpos[1] = 1.9
            robot.step(np.zeros(6, np.float32))
    last = [robot.step(np.zeros(6, np.float32))[1] for robot in (plain, alternating)]
    assert last[0] - last[1] == pytest.approx(1.0)
