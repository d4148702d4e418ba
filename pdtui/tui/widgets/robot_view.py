"""The robot itself: its links as solid limbs over a ground that moves past."""

from __future__ import annotations

from typing import Literal

import numpy as np
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip

from pdtui.robots.geometry import capsule_ends, place_links, root_body, rotate
from pdtui.tui.camera import Camera, Floats, round_length
from pdtui.tui.canvas import Canvas
from pdtui.tui.panel import Panel
from pdtui.tui.text import Row, number

View = Literal["side", "above"]
_ELEVATION: dict[View, float] = {"side": 14.0, "above": 90.0}
_GROUND, _AXIS, _SHADOW, _HEADING, _LABEL, _FIRST_SHADE = range(6)
_FARTHEST = 0.55
_BOX_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]


class RobotView(Panel):
    """The robot from the side (x to the right, z up) or from above (x to the right, y up)."""

    view: reactive[View] = reactive("side", init=False, repaint=False)

    _extent = 0.0

    def watch_view(self) -> None:
        """Look from elsewhere."""
        self.border_title = f"robot · {self.view}"
        self.redraw()

    def on_mount(self) -> None:
        """Name the panel."""
        self.border_title = f"robot · {self.view}"

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.briefing is None:
            return self._loading(width, height)
        if self.snapshot is None or not self.briefing.links:
            return []
        canvas = Canvas(width, height)
        placed = place_links(self.briefing.links, self.snapshot.poses)
        ends = capsule_ends(self.briefing.links, placed)
        if not np.isfinite(ends).all():
            canvas.text(1, height // 2, "the robot's pose is not finite", _LABEL)
            return canvas.strips(self._styles())
        root = self.snapshot.poses[root_body(self.briefing.links)]
        camera = self._camera(canvas, root, ends)
        self._draw_ground(canvas, camera, root)
        self._draw_shadow(canvas, camera, ends)
        self._draw_heading(canvas, camera, root)
        self._draw_links(canvas, camera, placed, ends)
        place = f"x {number(float(root[0]))}  y {number(float(root[1]))}  z {number(float(root[2]))} m"
        canvas.text(width - len(place), height - 1, place, _LABEL)
        return canvas.strips(self._styles())

    def _loading(self, width: int, height: int) -> list[Strip]:
        blank = [Strip.blank(width)] * max(0, height // 2 - 1)
        palette = self.palette
        lines = [
            ("loading the policy…", palette.title),
            ("robot and network are on their way", palette.muted),
        ]
        return [
            *blank,
            *(
                Row(width).add(" " * max(0, (width - len(line)) // 2), style).add(line, style).strip()
                for line, style in lines
            ),
        ]

    def _styles(self) -> list[Style]:
        palette = self.palette
        return [
            palette.faint,
            palette.muted,
            palette.faint,
            palette.accent,
            palette.muted,
            *palette.depth,
        ]

    def _camera(self, canvas: Canvas, root: Floats, ends: Floats) -> Camera:
        """Far enough away for the widest stretch that the robot has shown so far."""
        assert self.briefing is not None
        radii = np.array([_radius(link.size) for link in self.briefing.links])
        stretch = np.linalg.norm(ends - root[:3], axis=-1).max(axis=-1) + radii
        self._extent = max(self._extent, float(stretch.max()))
        extent = self._extent
        if self.view == "above":
            zoom = min(canvas.width, canvas.height) / (2.5 * extent)
            middle = (float(root[0]), float(root[1]), 0.0)
            return Camera(middle, 90.0, extent, zoom, (canvas.width / 2, canvas.height / 2))
        zoom = min(canvas.width / (2.15 * extent), canvas.height / (1.5 * extent))
        middle = (float(root[0]), float(root[1]), 0.45 * extent)
        return Camera(middle, _ELEVATION["side"], extent, zoom, (canvas.width / 2, canvas.height * 0.47))

    def _draw_ground(self, canvas: Canvas, camera: Camera, root: Floats) -> None:
        """A grid fixed to the world, so that its lines pass when the robot moves."""
        cell = round_length(camera.extent)
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
            canvas.points(dots[before][:, 0], dots[before][:, 1], inks)

    def _draw_shadow(self, canvas: Canvas, camera: Camera, ends: Floats) -> None:
        flat = ends * np.array([1.0, 1.0, 0.0])
        dots, _, before = camera.project(flat)
        kept = before.all(axis=-1)
        canvas.segments(dots[kept, 0], dots[kept, 1], _SHADOW)

    def _draw_heading(self, canvas: Canvas, camera: Camera, root: Floats) -> None:
        """Where the robot's own x axis points, as an arrow on the ground."""
        ahead = rotate(root[3:], np.array([1.0, 0.0, 0.0])) * np.array([1.0, 1.0, 0.0])
        length = float(np.linalg.norm(ahead))
        if length < 1e-6:
            return
        ahead /= length
        left = np.array([-ahead[1], ahead[0], 0.0])
        start = root[:3] * np.array([1.0, 1.0, 0.0])
        tip = start + ahead * camera.extent * 1.12
        barbs = [tip - (ahead * 0.2 + side * left * 0.14) * camera.extent for side in (1, -1)]
        lines = np.array([[start + ahead * camera.extent * 0.8, tip], [tip, barbs[0]], [tip, barbs[1]]])
        dots, _, before = camera.project(lines)
        if before.all():
            canvas.segments(dots[:, 0], dots[:, 1], _HEADING)

    def _draw_links(self, canvas: Canvas, camera: Camera, placed: Floats, ends: Floats) -> None:
        """Far links first and darker, near ones over them."""
        assert self.briefing is not None
        dots, magnification, before = camera.project(ends)
        depth = camera.depth(ends.mean(axis=-2))
        shades = len(self.palette.depth)
        shade = np.clip((0.5 - depth / camera.extent * 0.8) * shades, 0, shades - 1).astype(int)
        for row in np.argsort(-depth, kind="stable"):
            if not before[row].all():
                continue
            link, ink = self.briefing.links[row], _FIRST_SHADE + int(shade[row])
            if link.shape == "box":
                self._draw_box(canvas, camera, placed[row], link.size, ink)
                continue
            thick = link.size[0] * float(magnification[row].mean()) * camera.zoom
            canvas.capsule(dots[row, 0], dots[row, 1], thick, ink, halo=1.0)

    def _draw_box(
        self, canvas: Canvas, camera: Camera, pose: Floats, size: tuple[float, ...], ink: int
    ) -> None:
        signs = np.array([[(corner >> axis & 1) * 2 - 1 for axis in range(3)] for corner in range(8)])
        dots, _, before = camera.project(pose[:3] + rotate(pose[3:], signs * np.array(size)))
        if before.all():
            edges = np.array(_BOX_EDGES)
            canvas.segments(dots[edges[:, 0]], dots[edges[:, 1]], ink)


def _radius(size: tuple[float, ...]) -> float:
    return min(size)
