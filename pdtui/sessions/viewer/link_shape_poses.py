"""The poses of a robot's shapes as a session keeps them for the viewer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.robots.geometry import capsule_ends, compute_link_poses

VECTOR_LENGTHS = {
    "Capsules3D:translations": 3,
    "Capsules3D:quaternions": 4,
    "Boxes3D:centers": 3,
    "Boxes3D:quaternions": 4,
}
"""The columns of the entity of the robot, with the numbers per shape. Quaternions are x y z w."""


def round_links(links: Sequence[Link]) -> list[Link]:
    """Return the links that are drawn as capsules; a sphere is drawn as a capsule of length zero."""
    return [link for link in links if link.shape != "box"]


def box_links(links: Sequence[Link]) -> list[Link]:
    """Return the links that are drawn as boxes."""
    return [link for link in links if link.shape == "box"]


def place_link_shapes(links: Sequence[Link], poses: Floats) -> dict[str, NDArray[np.float32]]:
    """Return where the shapes are, from the poses of the bodies in n steps, shape (n, B, 7).

    There is one array (n, shapes, vector length) for each of the `VECTOR_LENGTHS` of which there are shapes.
    """
    found: dict[str, Floats] = {}
    if rounded := round_links(links):
        placed = compute_link_poses(rounded, poses)
        # The viewer's capsule starts at its translation and extends along z; ours is centered.
        found["Capsules3D:translations"] = capsule_ends(rounded, placed)[..., 0, :]
        found["Capsules3D:quaternions"] = placed[..., [4, 5, 6, 3]]
    if boxes := box_links(links):
        placed = compute_link_poses(boxes, poses)
        found["Boxes3D:centers"] = placed[..., :3]
        found["Boxes3D:quaternions"] = placed[..., [4, 5, 6, 3]]
    return {name: vectors.astype(np.float32) for name, vectors in found.items()}
