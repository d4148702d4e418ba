"""What the operator is shown: the trees in the picture from above, and nothing outside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.pictures.view_ahead import AHEAD, ASIDE, ViewAhead, measure_stretch
from pdtui.robots.geometry import capsule_ends, compute_link_poses, root_body_row

STEPS_PER_FRAME = 5
"""Control steps from one picture to the next: the screen shows 12 a second, of the A1's 62.5 steps."""


class OperatorSight:
    """Follows the robot as the screen does, and picks out the trees that it shows.

    The area is the least that a terminal of any size shows, about 5 m ahead and 1.7 m to either side for the
    A1. Trees that have left the picture are forgotten.

    Args:
        links: links of the robot.
        trees: x, y and radius of all trees, m, shape (N, 3).
    """

    def __init__(self, links: Sequence[Link], trees: Floats) -> None:
        self._links, self._trees = links, trees
        self._view, self._extent = ViewAhead(), 0.0

    def look(self, poses: Floats) -> Floats:
        """Return the trees of which the next picture shows a part; call it once per frame."""
        root = poses[root_body_row(self._links)]
        ends = capsule_ends(self._links, compute_link_poses(self._links, poses))
        self._extent = max(self._extent, measure_stretch(self._links, root, ends))
        self._view.follow(root)
        area = self._view.frame(root[:2], self._extent, AHEAD, ASIDE)
        beyond = np.abs(self._trees[:, :2] - area.middle) - area.size / 2
        return self._trees[(beyond < self._trees[:, 2:]).all(axis=1)]
