"""Roads and traffic on the screen: as drawn on a canvas, and in the robot's picture of a drive."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.style import Style
from textual.pilot import Pilot

from pdtui.core.scenery import NO_TRAFFIC, BoxKind, LineKind, RoadLine, Scenery, Traffic
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.pictures.view_ahead import frame_road
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.road_drawing import RoadLineDrawing, draw_traffic
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.robot_view import RobotView
from tests.small_road import APPEARS, VANISHES, small_road_loop
from tests.tui.conftest import MakeApp
from tests.tui.screens import played

LINES: dict[LineKind, int] = {"solid lane line": 1, "broken lane line": 2, "road edge": 3, "route": 4}
BOXES: dict[BoxKind, int] = {"vehicle": 5, "obstacle": 6}
SIZES = [(80, 24), (160, 48)]


def pose_heading(yaw: float) -> NDArray[np.float64]:
    return np.array([3.0, -2.0, 0.7, np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])


def ahead(yaw: float, along: float, left: float) -> list[float]:
    """A place as seen by the robot of `pose_heading`."""
    return [3.0 + along * np.cos(yaw) - left * np.sin(yaw), -2.0 + along * np.sin(yaw) + left * np.cos(yaw)]


@pytest.mark.parametrize("yaw", [0.0, pi / 2, -2.0])
def test_what_lies_ahead_is_above_and_what_lies_left_is_left(yaw: float) -> None:
    canvas = BrailleCanvas(60, 30)
    camera = frame_road(pose_heading(yaw), canvas.width, canvas.height)
    places = [[*ahead(yaw, along, left), 0.0] for along, left in ((0, 0), (20, 0), (0, 10), (-5, 0))]
    (here, front, beside, behind), _, _ = camera.project(np.array(places))
    assert front == pytest.approx(here - [0.0, 20 * camera.zoom])
    assert beside == pytest.approx(here - [10 * camera.zoom, 0.0])
    assert behind == pytest.approx(here - [0.0, -5 * camera.zoom])
    assert canvas.height > behind[1]
    assert canvas.height / camera.zoom == pytest.approx(60.0)


def test_a_small_picture_shows_60_m_along_its_longer_side() -> None:
    assert 64 / frame_road(pose_heading(0.0), 64, 36).zoom == pytest.approx(60.0)


@pytest.mark.parametrize("yaw", [0.0, 1.0])
def test_dashes_and_solid_lines_differ(yaw: float) -> None:
    canvas = BrailleCanvas(60, 30)
    camera = frame_road(pose_heading(yaw), canvas.width, canvas.height)
    ends = [[ahead(yaw, -60.0, left), ahead(yaw, 60.0, left)] for left in (5.0, -5.0)]
    lines = RoadLine("solid lane line", np.array(ends[0])), RoadLine("broken lane line", np.array(ends[1]))
    RoadLineDrawing(lines, LINES).draw(canvas, camera)
    left, right = canvas.dots[:, :60], canvas.dots[:, 60:]
    assert left.any(axis=1).all()
    dashed = right.any(axis=1)
    assert 0.25 < dashed.mean() < 0.6
    assert (np.diff(dashed.astype(int)) == 1).sum() >= 6


def test_a_box_is_filled_as_long_and_wide_as_it_is() -> None:
    canvas = BrailleCanvas(60, 30)
    canvas.dots[:] = True  # a ground as dense as can be
    camera = frame_road(pose_heading(0.3), canvas.width, canvas.height)
    poses = np.array([[*ahead(0.3, 20.0, 0.0), 0.0, 0.3]])
    car = Traffic(np.zeros(1, np.int64), ("vehicle",), poses, np.array([[10.0, 5.0, 0.0]]))
    draw_traffic(canvas, camera, car, BOXES, filled=True)
    (x, y), zoom = camera.center, camera.zoom
    across = np.abs(np.arange(120)[None, :] + 0.5 - x) / zoom
    along = np.abs(np.arange(120)[:, None] + 0.5 - y + 20.0 * zoom) / zoom
    assert canvas.dots[(across < 2.4) & (along < 4.9)].all()
    rim = (across < 2.5 + 0.9 / zoom) & (along < 5.0 + 0.9 / zoom) & ~((across <= 2.6) & (along <= 5.1))
    assert rim.any()
    assert not canvas.dots[rim].any()
    assert canvas.dots[(across > 4.0) | (along > 7.0)].all()


def road_drive(steps: int) -> tuple[ControlLoop, DriveFacts, list[DriveSnapshot]]:
    """A snapshot after each step of a drive on the small road."""
    loop = small_road_loop()
    builder, snapshots = SnapshotBuilder(loop), []
    for _ in range(steps):
        builder.add_step(loop.advance())
        snapshots.append(
            builder.build_snapshot(paused=False, speed=1.0, achieved_speed=1.0, recorded_bytes=0, finished="")
        )
    facts = DriveFacts("Small road", "small", 3, 0.1, loop.robot.attributes, loop.robot.links, (8,))
    return loop, facts, snapshots


def dots_in(view: RobotView, style: Style) -> int:
    """The number of dots in a color."""
    return sum(
        bin(ord(character) - 0x2800).count("1")
        for strip in view.paint(*view.content_size)
        for segment in strip
        if segment.style == style
        for character in segment.text
        if 0x2800 < ord(character) < 0x2900
    )


@pytest.mark.parametrize("size", SIZES)
async def test_a_drive_on_a_road_shows_it_from_above(make_app: MakeApp, size: tuple[int, int]) -> None:
    loop, facts, snapshots = road_drive(VANISHES + 1)
    assert [snapshot.scenery is not None for snapshot in snapshots] == [True] + [False] * VANISHES
    app, connection = make_app([facts, snapshots[0]], loop.map)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        view = app.query_one(RobotView)
        shown_view: str = view.view
        assert shown_view == "above"
        for style in (STYLES.text, STYLES.primary, STYLES.muted, STYLES.obstacle, STYLES.accent):
            assert dots_in(view, style), "road edge, route, lane lines, cones, and the robot itself"
        counted = [await vehicle_dots(pilot, view, snapshots[step - 1]) for step in (APPEARS, VANISHES)]
        assert counted[0] > 2 * counted[1] > 0, "the truck is no longer there, the parked car is"
        assert await vehicle_dots(pilot, view, replace(snapshots[-1], traffic=NO_TRAFFIC)) == 0
        await pilot.press("v")
        assert await vehicle_dots(pilot, view, snapshots[-1]) > 0, "boxes are drawn from the side, too"


async def vehicle_dots(pilot: Pilot[str], view: RobotView, snapshot: DriveSnapshot) -> int:
    view.snapshot = snapshot
    await pilot.pause(0.02)
    return dots_in(view, STYLES.warn)


async def test_another_world_takes_the_place_of_the_first(make_app: MakeApp) -> None:
    loop, facts, snapshots = road_drive(1)
    elsewhere = replace(snapshots[0], scenery=Scenery(), traffic=NO_TRAFFIC)
    app, connection = make_app([facts, snapshots[0], elsewhere], loop.map)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        view = app.query_one(RobotView)
        for style in (STYLES.primary, STYLES.obstacle, STYLES.warn):
            assert dots_in(view, style) == 0
