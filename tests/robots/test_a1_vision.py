"""The camera of one row sees the trees that PyBullet's own rays hit."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("pybullet", reason="PyBullet is not installed (it has no wheels for this Python)")

from pdtui.robots import make_robot
from pdtui.robots.a1_vision import A1Vision, observe_trees_along_rays

FAN = np.radians(np.linspace(60.0, -60.0, 32))


def test_it_sees_what_the_simulators_rays_hit() -> None:
    robot = make_robot("a1-vision", density=0.3)
    assert isinstance(robot, A1Vision)
    seen, _ = robot.reset(seed=3)
    assert seen.shape == robot.observation_space.shape
    nonzero = 0
    for x, y, yaw in ((0.0, 0.0, 0.0), (9.0, -2.0, 1.0), (20.0, 4.0, -2.5)):
        ends = [[x + 5.0 * math.cos(yaw + a), y + 5.0 * math.sin(yaw + a), 0.6] for a in FAN]
        hits = robot.bullet.rayTestBatch([[x, y, 0.6]] * len(FAN), ends)
        expected = 1.0 - np.array([hit[2] for hit in hits])
        found = observe_trees_along_rays((x, y), yaw, robot.scenery.cylinders, FAN, 5.0)
        # Bullet's cylinders have a margin, and a ray along an edge may go either way.
        assert np.quantile(np.abs(found - expected), 0.9) < 0.01
        nonzero += int((found > 0).sum())
    assert nonzero > 20


def test_nothing_is_seen_where_nothing_is() -> None:
    assert not observe_trees_along_rays((0.0, 0.0), 0.0, np.empty((0, 3)), FAN, 5.0).any()
    behind = np.array([[-2.0, 0.0, 0.2]])
    assert not observe_trees_along_rays((0.0, 0.0), 0.0, behind, FAN, 5.0).any()
    ahead = observe_trees_along_rays((0.0, 0.0), math.pi, behind, np.zeros(1), 5.0)
    assert ahead[0] == pytest.approx(1.0 - 1.8 / 5.0)
