"""Draw the links of a robot as solid shapes in the viewer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.robots.geometry import capsule_ends, compute_link_poses
from pdtui.sessions.writer.arrow_columns import ComponentColumn, vector_list_column

_COLOR = (214, 137, 76)
_TORSO = (90, 122, 158)


class ViewerLinkShapes:
    """The links of a robot as capsules, spheres and boxes."""

    def __init__(self, links: Sequence[Link]) -> None:
        # A sphere is drawn as a capsule of length zero.
        self._round = [link for link in links if link.shape != "box"]
        self._boxes = [link for link in links if link.shape == "box"]

    def static(self) -> list[rr.Capsules3D | rr.Boxes3D]:
        """Return sizes and colors, which do not change."""
        parts: list[rr.Capsules3D | rr.Boxes3D] = []
        if self._round:
            lengths = [2 * link.size[1] if link.shape == "capsule" else 0.0 for link in self._round]
            radii = [link.size[0] for link in self._round]
            parts.append(rr.Capsules3D.from_fields(lengths=lengths, radii=radii, **_style(self._round)))
        if self._boxes:
            sizes = [link.size for link in self._boxes]
            parts.append(rr.Boxes3D.from_fields(half_sizes=sizes, **_style(self._boxes)))
        return parts

    def columns(self, poses: Floats) -> list[ComponentColumn]:
        """Return where the shapes are, from the poses of the bodies in n steps, shape (n, B, 7)."""
        columns = []
        if self._round:
            placed = compute_link_poses(self._round, poses)
            # The viewer's capsule starts at its translation and extends along z; ours is centred.
            starts = capsule_ends(self._round, placed)[..., 0, :]
            columns += [
                vector_list_column(rr.Capsules3D.descriptor_translations(), starts.astype(np.float32)),
                vector_list_column(rr.Capsules3D.descriptor_quaternions(), _xyzw(placed)),
            ]
        if self._boxes:
            placed = compute_link_poses(self._boxes, poses)
            columns += [
                vector_list_column(rr.Boxes3D.descriptor_centers(), placed[..., :3].astype(np.float32)),
                vector_list_column(rr.Boxes3D.descriptor_quaternions(), _xyzw(placed)),
            ]
        return columns


def _xyzw(placed: Floats) -> NDArray[np.float32]:
    return placed[..., [4, 5, 6, 3]].astype(np.float32)


def _style(links: Sequence[Link]) -> dict[str, Any]:
    return {"colors": [_TORSO if link.body == 0 else _COLOR for link in links], "fill_mode": "solid"}
