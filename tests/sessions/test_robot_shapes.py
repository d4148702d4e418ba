"""The robot's links land in the viewer where the robot has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from pdtui.core.robot_links_and_state import Link
from pdtui.sessions.viewer.viewer_link_shapes import ViewerLinkShapes

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
ON_ITS_SIDE = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
LINKS = (
    Link("ball", 0, "sphere", (0.3,), (0.0, 0.0, 1.0), UPRIGHT),
    Link("leg", 1, "capsule", (0.1, 0.5), (0.0, 0.0, 0.0), UPRIGHT),
    Link("foot", 1, "box", (0.2, 0.1, 0.05), (0.0, 0.0, -0.5), UPRIGHT),
)


def drawn(links: tuple[Link, ...], poses: np.ndarray[Any, Any]) -> dict[str, np.ndarray[Any, Any]]:
    """What the columns say, as arrays (steps, shapes, numbers) by component."""
    return {
        column.component_descriptor().component: np.array(column.as_arrow_array().to_pylist())
        for column in ViewerLinkShapes(links).columns(poses)
    }


def test_shapes_follow_their_bodies() -> None:
    poses = np.zeros((2, 2, 7))
    poses[..., 3] = 1.0
    poses[1, :, 0] = 4.0
    poses[1, 1, 3:] = ON_ITS_SIDE
    found = drawn(LINKS, poses)
    # A capsule of the viewer starts at its translation; this leg reaches half a meter to both sides.
    expected = np.array([[[0, 0, 1], [0, 0, -0.5]], [[4, 0, 1], [3.5, 0, 0]]])
    np.testing.assert_allclose(found["Capsules3D:translations"], expected, atol=1e-6)
    np.testing.assert_allclose(found["Boxes3D:centers"], [[[0, 0, -0.5]], [[3.5, 0, 0]]], atol=1e-6)
    x, y, z, w = np.sqrt(0.5) * np.array([0.0, 1.0, 0.0, 1.0])
    np.testing.assert_allclose(found["Boxes3D:quaternions"][1], [[x, y, z, w]], atol=1e-6)


def test_a_robot_without_boxes_has_no_boxes() -> None:
    assert {name.partition(":")[0] for name in drawn(LINKS[:2], np.ones((1, 2, 7)))} == {"Capsules3D"}
    assert len(ViewerLinkShapes(LINKS[:2]).static()) == 1
    assert len(ViewerLinkShapes(LINKS).static()) == 2
    assert ViewerLinkShapes(()).static() == []
    assert ViewerLinkShapes(()).columns(np.ones((1, 2, 7))) == []
