"""How the screen shows the ghost: what it says of it, and its body beside the robot's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.printable_text import make_printable
from pdtui.core.robot_links_and_state import Link
from pdtui.driving.ghost.ghost_snapshot import GhostSnapshot
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.robots.geometry import capsule_ends, compute_link_poses
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.cell_text import format_number
from pdtui.tui.road_drawing import compute_box_corners, draw_box_edges

_BEHIND = 5  # control steps from which it is said that the ghost is behind
_CONDITIONS = {
    "loading": "ghost: loading",
    "waiting": "ghost: waits for a behavior",
    "starting": "ghost: starting",
}


def describe_ghost(ghost: GhostSnapshot, step: int) -> str:
    """Return in a few words how the ghost is, when the drive has done `step` control steps."""
    if ghost.condition == "failed":
        return make_printable(ghost.message)
    if ghost.condition == "over":
        return f"ghost: {make_printable(ghost.message)}"
    if ghost.condition == "running" and ghost.latest is not None:
        behind = step - ghost.latest.step
        since = " ".join(filter(None, ("ghost", make_printable(ghost.label), f"since step {ghost.first}")))
        return since if behind < _BEHIND else f"ghost: {behind} steps behind"
    return _CONDITIONS.get(ghost.condition, "")


def add_ghost_to_title(title: str, ghost: GhostSnapshot | None, step: int) -> str:
    """Return the title of a table that compares the drive with its ghost, if there is one."""
    if ghost is None:
        return title
    said = describe_ghost(ghost, step)
    return said if ghost.condition == "failed" else f"{title} · {said}"


def draw_ghost(
    canvas: BrailleCanvas, camera: PerspectiveCamera, links: Sequence[Link], poses: Floats, ink: int
) -> None:
    """Draw the ghost's shapes in one color and without rims, for poses of its bodies (B, 7)."""
    placed = compute_link_poses(links, poses)
    ends = capsule_ends(links, placed)
    if not np.isfinite(ends).all():
        return
    dots, magnification, before = camera.project(ends)
    for row in np.flatnonzero(before.all(axis=1)).tolist():
        link = links[row]
        if link.shape == "box":
            corners, _, corners_before = camera.project(compute_box_corners(link, placed[row]))
            if corners_before.all():
                draw_box_edges(canvas, corners, ink)
        else:
            thick = link.size[0] * float(magnification[row].mean()) * camera.zoom
            canvas.draw_capsule(dots[row, 0], dots[row, 1], thick, ink)


def draw_ghost_arrow(
    canvas: BrailleCanvas, camera: PerspectiveCamera, ghost: Floats, robot: Floats, ink: int
) -> None:
    """Say at the edge how far away the ghost is if it is outside the picture; poses (7,) of both roots."""
    dots, _, before = camera.project(ghost[None, :3])
    x, y = dots[0]
    inside = before[0] and 0 <= x < canvas.width and 0 <= y < canvas.height
    if inside or not np.isfinite(ghost).all():
        return
    said = f"ghost {format_number(float(np.hypot(*(ghost[:2] - robot[:2]))))} m"
    is_right = bool(x >= canvas.width / 2)
    said = f"{said} ▶" if is_right else f"◀ {said}"
    canvas.draw_text(canvas.columns - len(said) if is_right else 0, 0, said, ink)
