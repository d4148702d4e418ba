"""Soles of feet that roll, slide and stand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdtui.core.robot_links_and_state import Link
from pdtui.evaluation.gait.sole_motion import find_soles, measure_sole_speeds

DT = 0.01
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
BALL = Link("ball", 0, "sphere", (0.1,), (0.0, 0.0, 0.0), UPRIGHT)


def _poses(places: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Return the poses of one body, shape (T, 1, 7), that turns about y."""
    poses = np.zeros((len(places), 1, 7))
    poses[:, 0, :3] = places
    poses[:, 0, 3], poses[:, 0, 5] = np.cos(pitch / 2), np.sin(pitch / 2)
    return poses


def test_the_sole_is_the_lowest_point() -> None:
    leg = Link("leg", 0, "capsule", (0.1, 0.5), (0.0, 0.0, 0.0), UPRIGHT)
    box = Link("box", 0, "box", (0.1, 0.2, 0.5), (0.0, 0.0, 0.0), UPRIGHT)
    poses = _poses(np.array([[1.0, 2.0, 3.0]]), np.array([math.pi / 6]))
    ball, lower_end, corner = find_soles([BALL, leg, box], poses)[0]
    np.testing.assert_allclose(ball, (1.0, 2.0, 2.9))
    np.testing.assert_allclose(lower_end, (1.0 - 0.25, 2.0, 3.0 - 0.5 * math.cos(math.pi / 6) - 0.1))
    assert corner[2] == pytest.approx(3.0 - 0.5 * math.cos(math.pi / 6) - 0.1 * math.sin(math.pi / 6))


def test_a_ball_that_rolls_does_not_slide() -> None:
    turned = np.linspace(0.0, 2.0, 41)  # 0.05 rad per step, 5 rad/s
    places = np.stack([0.1 * turned, np.zeros(41), np.full(41, 0.1)], axis=1)
    poses = _poses(places, turned)
    speeds = measure_sole_speeds([BALL], poses, find_soles([BALL], poses), DT)
    assert speeds.shape == (40, 1)
    assert speeds.max() < 0.01  # while its middle moves at 0.5 m/s


def test_a_ball_that_turns_on_the_spot_slides() -> None:
    turned = np.linspace(0.0, 2.0, 41)
    poses = _poses(np.tile((0.0, 0.0, 0.1), (41, 1)), turned)
    speeds = measure_sole_speeds([BALL], poses, find_soles([BALL], poses), DT)
    np.testing.assert_allclose(speeds, 0.5, rtol=1e-3)


def test_a_foot_that_is_carried_along_slides_as_fast() -> None:
    along = np.linspace(0.0, 1.0, 11)
    poses = _poses(np.stack([along, 2.0 * along, np.full(11, 0.1)], axis=1), np.zeros(11))
    speeds = measure_sole_speeds([BALL], poses, find_soles([BALL], poses), DT)
    np.testing.assert_allclose(speeds, math.hypot(10.0, 20.0))
