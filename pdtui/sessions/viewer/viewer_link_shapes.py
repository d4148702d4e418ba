"""Draw the links of a robot as solid shapes in the viewer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import rerun as rr

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.sessions.viewer.link_shape_poses import box_links, place_link_shapes, round_links
from pdtui.sessions.writer.arrow_columns import ComponentColumn, vector_list_column

_DESCRIPTORS = {
    "Capsules3D:translations": rr.Capsules3D.descriptor_translations,
    "Capsules3D:quaternions": rr.Capsules3D.descriptor_quaternions,
    "Boxes3D:centers": rr.Boxes3D.descriptor_centers,
    "Boxes3D:quaternions": rr.Boxes3D.descriptor_quaternions,
}
_COLOR = (214, 137, 76)
_TORSO = (90, 122, 158)


class ViewerLinkShapes:
    """The links of a robot as capsules, spheres and boxes."""

    def __init__(self, links: Sequence[Link]) -> None:
        self._links = links
        self._round, self._boxes = round_links(links), box_links(links)

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
        placed = place_link_shapes(self._links, poses)
        return [vector_list_column(_DESCRIPTORS[name](), vectors) for name, vectors in placed.items()]


def _style(links: Sequence[Link]) -> dict[str, Any]:
    return {"colors": [_TORSO if link.body == 0 else _COLOR for link in links], "fill_mode": "solid"}
