"""The picture of the robot: solid limbs over a ground grid that moves past."""

from __future__ import annotations

from typing import Literal

import numpy as np
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip

from pdtui.core.attributes import Floats
from pdtui.core.scenery import NO_SCENERY, BoxKind, LineKind, Scenery, Traffic
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.pictures.perspective_camera import PerspectiveCamera, round_length_down
from pdtui.pictures.view_ahead import AHEAD, ViewAhead, frame_road, heading_on_ground, measure_stretch
from pdtui.robots.geometry import capsule_ends, compute_link_poses, root_body_row
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.ghost_drawing import draw_ghost, draw_ghost_arrow
from pdtui.tui.obstacle_drawing import draw_obstacles_from_above, draw_obstacles_from_side
from pdtui.tui.road_drawing import (
    RoadLineDrawing,
    compute_box_corners,
    draw_box_edges,
    draw_lidar_hits,
    draw_links_on_road,
    draw_traffic,
)
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES

View = Literal["side", "above"]
_SIDE_ELEVATION = 14.0  # of the camera at the side, degrees
_GROUND, _AXIS, _SHADOW, _ROBOT, _LABEL, _OBSTACLE = range(6)
_LANE, _EDGE, _ROUTE, _VEHICLE, _GHOST, _FIRST_SHADE = range(6, 12)
_LINE_INKS: dict[LineKind, int] = {
    "solid lane line": _LANE,
    "broken lane line": _LANE,
    "road edge": _EDGE,
    "route": _ROUTE,
}
_BOX_INKS: dict[BoxKind, int] = {"vehicle": _VEHICLE, "obstacle": _OBSTACLE}
_FARTHEST = 0.55  # least magnification of the ground grid that is drawn
_ARROW = 0.5  # least size of the heading arrow, in extents of the camera
_REACH, _REACH_AHEAD, _FORWARD = 2.15, 4.2, 0.28
"""Width of the picture from the side, usually and among boxes, in extents of the robot; how far its middle is
ahead of the robot then, as a share of the width."""


class RobotView(SnapshotWidget):
    """Draws the robot from the side (x to the right, z up) or from above (x to the right, y up).

    With obstacles around, the view from above comes first, reaches farther and shows more of what lies ahead.
    On a road it reaches 60 m, and the robot's heading is up.
    """

    BORDER_TITLE = "robot · side"
    view: reactive[View] = reactive("side", init=False, repaint=False)
    _scenery: Scenery = NO_SCENERY
    _road_lines = RoadLineDrawing((), _LINE_INKS)
    _extent, _looked = 0.0, False

    def on_mount(self) -> None:
        self._view_ahead = ViewAhead()

    def watch_view(self) -> None:
        self.border_title = f"robot · {self.view}"
        self.redraw()

    def toggle_view(self) -> None:
        """Look from above instead of from the side, or the other way round."""
        self.view = "above" if self.view == "side" else "side"

    def on_click(self) -> None:
        self.toggle_view()

    def remember(self, snapshot: DriveSnapshot) -> None:
        if snapshot.scenery is not None:
            self._scenery = snapshot.scenery
            self._road_lines = RoadLineDrawing(self._scenery.lines, _LINE_INKS)
            if (len(self._scenery.cylinders) or self._scenery.lines) and not self._looked:
                self._looked, self.view = True, "above"
        if self.facts is not None and self._looks_ahead(snapshot) and len(snapshot.poses):
            root = snapshot.poses[root_body_row(self.facts.links)]
            self._view_ahead.follow(root, restarted=snapshot.restarted)

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.facts is None:
            return self._loading(width, height)
        if self.snapshot is None or not self.facts.links:
            return []
        canvas = BrailleCanvas(width, height)
        placed = compute_link_poses(self.facts.links, self.snapshot.poses)
        ends = capsule_ends(self.facts.links, placed)
        if not np.isfinite(ends).all():
            canvas.draw_text(1, height // 2, "the robot's pose is not finite", _LABEL)
            return canvas.render_strips(_inks())
        root = self.snapshot.poses[root_body_row(self.facts.links)]
        camera = self._camera(canvas, root, ends)
        if self._shows_road:
            self._draw_surroundings(canvas, camera, self.snapshot.traffic)
            self._draw_ghost(canvas, camera, root)
            draw_links_on_road(canvas, camera, self.facts.links, placed, ends, _ROBOT)
        else:
            self._draw_ground(canvas, camera, root)
            self._draw_shadow(canvas, camera, ends)
            self._draw_surroundings(canvas, camera, self.snapshot.traffic)
            self._draw_heading(canvas, camera, root)
            self._draw_ghost(canvas, camera, root)
            self._draw_links(canvas, camera, placed, ends)
        if self.view == "side":
            draw_obstacles_from_side(canvas, camera, self._scenery.cylinders, _OBSTACLE, behind=False)
        x, y, z = (format_number(float(value)) for value in root[:3])
        place = f"x {x}  y {y}  z {z} m"
        canvas.draw_text(width - len(place), height - 1, place, _LABEL)
        return canvas.render_strips(_inks())

    @property
    def _shows_road(self) -> bool:
        """Whether the picture is the one of a road from above, which is as simple as a map."""
        return self.view == "above" and bool(self._scenery.lines)

    def _looks_ahead(self, snapshot: DriveSnapshot) -> bool:
        """Return whether there are obstacles but no road, so that the view from above looks ahead."""
        return bool(len(self._scenery.cylinders) or (snapshot.traffic.kinds and not self._scenery.lines))

    def _loading(self, width: int, height: int) -> list[Strip]:
        lines = (("loading the policy…", STYLES.title), ("this takes a few seconds", STYLES.muted))
        blank = [Strip.blank(width)] * max(0, height // 2 - 1)
        return blank + [
            ScreenRow(width).add(" " * max(0, (width - len(line)) // 2), style).add(line, style).strip()
            for line, style in lines
        ]

    def _camera(self, canvas: BrailleCanvas, root: Floats, ends: Floats) -> PerspectiveCamera:
        """Return a camera far enough away for the widest stretch that the robot has shown so far."""
        assert self.facts is not None
        self._extent = max(self._extent, measure_stretch(self.facts.links, root, ends))
        extent, center = self._extent, (canvas.width / 2, canvas.height / 2)
        if self._shows_road:
            return frame_road(root, canvas.width, canvas.height)
        assert self.snapshot is not None
        if self.view == "above" and self._looks_ahead(self.snapshot):
            area = self._view_ahead.frame(root[:2], extent, canvas.width, canvas.height)
            x, y = area.middle.tolist()
            return PerspectiveCamera((x, y, 0.0), 90.0, AHEAD / 2 * extent, area.zoom, center)
        if self.view == "above":
            zoom = min(canvas.width, canvas.height) / (2.5 * extent)
            middle = (float(root[0]), float(root[1]), 0.0)
            return PerspectiveCamera(middle, 90.0, extent, zoom, center)
        reach, forward = (_REACH_AHEAD, _FORWARD) if self.snapshot.traffic.kinds else (_REACH, 0.0)
        zoom = min(canvas.width / (reach * extent), canvas.height / (1.5 * extent))
        middle = (float(root[0]) + forward * canvas.width / zoom, float(root[1]), 0.45 * extent)
        center = canvas.width / 2, canvas.height * 0.47
        return PerspectiveCamera(middle, _SIDE_ELEVATION, extent, zoom, center)

    def _draw_ground(self, canvas: BrailleCanvas, camera: PerspectiveCamera, root: Floats) -> None:
        """Draw a grid fixed to the world, whose lines pass by as the robot moves."""
        cell = round_length_down(camera.extent)
        reach = 9 if self.view == "side" else 6
        middle = np.round(root[:2] / cell)
        lines = np.arange(-reach, reach + 1)
        along = np.arange(-reach * 4, reach * 4 + 1) / 4
        for axis in (0, 1):
            fixed = (middle[axis] + lines) * cell
            moving = (middle[1 - axis] + along) * cell
            grid = np.zeros((len(fixed), len(moving), 3))
            grid[..., axis], grid[..., 1 - axis] = fixed[:, None], moving
            dots, magnification, before = camera.project(grid)
            before &= magnification > _FARTHEST
            ink = np.where(np.isclose(fixed, 0.0), _AXIS, _GROUND).astype(np.int16)
            inks = np.broadcast_to(ink[:, None], before.shape)[before]
            canvas.draw_points(dots[before][:, 0], dots[before][:, 1], inks)

    def _draw_surroundings(self, canvas: BrailleCanvas, camera: PerspectiveCamera, traffic: Traffic) -> None:
        """Draw scenery and traffic, except obstacles between the robot and a camera at its side."""
        draw_lidar_hits(canvas, camera, traffic.lidar_hits, _SHADOW)
        self._road_lines.draw(canvas, camera)
        if self.view == "above":
            draw_obstacles_from_above(canvas, camera, self._scenery.cylinders, _OBSTACLE)
        else:
            draw_obstacles_from_side(canvas, camera, self._scenery.cylinders, _OBSTACLE, behind=True)
        draw_traffic(canvas, camera, traffic, _BOX_INKS, filled=self._shows_road)

    def _draw_shadow(self, canvas: BrailleCanvas, camera: PerspectiveCamera, ends: Floats) -> None:
        flat = ends * np.array([1.0, 1.0, 0.0])
        dots, _, before = camera.project(flat)
        kept = before.all(axis=-1)
        canvas.draw_segments(dots[kept, 0], dots[kept, 1], _SHADOW)

    def _draw_ghost(self, canvas: BrailleCanvas, camera: PerspectiveCamera, root: Floats) -> None:
        """Draw the ghost beneath the robot, or say where it is."""
        assert self.facts is not None
        shown = self.snapshot is not None and self.snapshot.past is None
        ghost = self.snapshot.ghost if self.snapshot is not None and shown else None
        if ghost is not None and ghost.latest is not None and len(ghost.latest.poses):
            poses = ghost.latest.poses
            draw_ghost(canvas, camera, self.facts.links, poses, _GHOST)
            draw_ghost_arrow(canvas, camera, poses[root_body_row(self.facts.links)], root, _GHOST)

    def _draw_heading(self, canvas: BrailleCanvas, camera: PerspectiveCamera, root: Floats) -> None:
        """Draw the direction of the robot's own x axis as an arrow on the ground."""
        x, y = heading_on_ground(root)
        if not (x or y):
            return
        ahead, left = np.array([x, y, 0.0]), np.array([-y, x, 0.0])
        start = root[:3] * np.array([1.0, 1.0, 0.0])
        size = max(self._extent, _ARROW * camera.extent)
        tail = start + ahead * self._extent * 0.8
        tip = tail + ahead * size * 0.32
        barbs = [tip - (ahead * 0.2 + side * left * 0.14) * size for side in (1, -1)]
        lines = np.array([[tail, tip], [tip, barbs[0]], [tip, barbs[1]]])
        dots, _, before = camera.project(lines)
        if before.all():
            canvas.draw_segments(dots[:, 0], dots[:, 1], _ROBOT)

    def _draw_links(
        self, canvas: BrailleCanvas, camera: PerspectiveCamera, placed: Floats, ends: Floats
    ) -> None:
        """Draw far links first and darker, and near ones over them."""
        assert self.facts is not None
        dots, magnification, before = camera.project(ends)
        depth = camera.depth(ends.mean(axis=-2))
        shades = len(STYLES.depth)
        shade = np.clip((0.5 - depth / self._extent * 0.8) * shades, 0, shades - 1).astype(int)
        for row in np.argsort(-depth, kind="stable"):
            if not before[row].all():
                continue
            link, ink = self.facts.links[row], _FIRST_SHADE + int(shade[row])
            if link.shape == "box":
                corners, _, corners_before = camera.project(compute_box_corners(link, placed[row]))
                if corners_before.all():
                    draw_box_edges(canvas, corners, ink)
                continue
            thick = link.size[0] * float(magnification[row].mean()) * camera.zoom
            canvas.draw_capsule(dots[row, 0], dots[row, 1], thick, ink, halo=1.0)


def _inks() -> tuple[Style, ...]:
    return (
        *(STYLES.faint, STYLES.muted, STYLES.faint, STYLES.accent, STYLES.muted, STYLES.obstacle),
        *(STYLES.muted, STYLES.text, STYLES.primary, STYLES.warn, STYLES.ghost),
        *STYLES.depth,
    )
