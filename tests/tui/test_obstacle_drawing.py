"""Obstacles on the screen, and the counters of a drive among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.scenery import Scenery, Traffic
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.sessions.episode_statistics import NO_STATISTICS, EpisodeStatistics
from pdtui.tui.braille_canvas import BrailleCanvas
from pdtui.tui.obstacle_drawing import draw_obstacles_from_above, draw_obstacles_from_side
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.robot_view import RobotView
from tests.tui.conftest import MakeApp
from tests.tui.screens import notice, played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]
INK = 1
TALLY = EpisodeStatistics(episode=12, steps=8000, involvement=1400, distance=-123.4, collisions=12.0)


def test_a_disc_has_the_radius_of_its_obstacle() -> None:
    canvas = BrailleCanvas(40, 20)
    camera = PerspectiveCamera((0.0, 0.0, 0.0), 90.0, 100.0, 10.0, (40.0, 40.0))
    canvas.dots[:] = True  # a ground as dense as can be
    draw_obstacles_from_above(canvas, camera, np.array([[1.0, 2.0, 0.6], [50.0, 0.0, 1.0]]), INK)
    rows, columns = np.nonzero(canvas.inks == INK)
    assert (columns.min(), columns.max(), rows.min(), rows.max()) == (22, 27, 3, 6)
    distance = np.hypot(np.arange(80)[None, :] + 0.5 - 50.0, np.arange(80)[:, None] + 0.5 - 20.0)
    assert canvas.dots[distance <= 6.0].all()
    assert not canvas.dots[(distance > 6.0) & (distance <= 7.0)].any()


def test_a_trunk_before_the_robot_hides_nothing() -> None:
    camera = PerspectiveCamera((0.0, 0.0, 0.0), 14.0, 1.0, 20.0, (40.0, 40.0))
    filled = []
    for y in (1.0, -1.0):
        canvas = BrailleCanvas(40, 20)
        for behind in (True, False):
            draw_obstacles_from_side(canvas, camera, np.array([[0.0, y, 0.3]]), INK, behind=behind)
        assert canvas.dots[0].any(), "it reaches up to the picture's edge"
        filled.append(bool(canvas.dots[10, 40]))
    assert filled == [True, False]


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_a_drive_among_obstacles_begins_from_above(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, (first, *rest) = drive[0], drive[1][:6]
    x, y = first.poses[0, :2]
    ahead = np.array([[x + 6.0, y + 0.5, 0.3]])
    messages = [facts, replace(first, scenery=Scenery(cylinders=ahead)), *rest[:2]]
    app, connection = make_app(messages)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        robot = app.query_one(RobotView)
        assert robot.view == "above"
        obstacle = STYLES.obstacle
        inks = [
            segment.text.strip()
            for strip in robot.paint(*robot.content_size)
            for segment in strip
            if segment.style == obstacle
        ]
        assert any(inks), "what is 6 m ahead of an Ant is in the picture"
        await pilot.press("v")
        connection.messages.append(replace(rest[2], scenery=Scenery(cylinders=ahead + 1.0)))
        await played(pilot, connection)
        chosen: str = robot.view
        assert chosen == "side", "what the user chose stays"


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_a_wall_ahead_is_seen_from_the_side_and_from_above(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, (first, *_) = drive
    x, y = first.poses[0, :2]
    app, connection = make_app([facts, first])
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        robot = app.query_one(RobotView)
        near = 2.5 * robot._extent  # beyond the edge of the picture of a robot without obstacles
        wall = Traffic(
            np.array([0]), ("obstacle",), np.array([[x + near, y, 0.5, 0.0]]), np.array([[0.1, 2.0, 1.0]])
        )
        counted = replace(NO_STATISTICS, passed=3.0, steps=100, involvement=1)
        for view in ("side", "above"):
            robot.view = view
            connection.messages.append(replace(first, traffic=wall, statistics=counted))
            await played(pilot, connection)
            drawn = [
                segment.text.strip()
                for strip in robot.paint(*robot.content_size)
                for segment in strip
                if segment.style == STYLES.obstacle
            ]
            assert any(drawn), view
        assert "3 passed · 1 step with a key" in notice(app)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_counters_are_whole_at_every_size(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    app, connection = make_app([facts, replace(snapshots[0], statistics=TALLY)])
    counters = "episode 12: −123.4 m · 12 collisions · 1400 steps with a key (17.5 %)"
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        line = notice(app)
        assert line.rstrip().endswith(counters)
        assert len(line) == size[0]
        app.say("what must be read " * 3)
        await pilot.pause(0.05)
        assert "what must be read " * 3 in notice(app)
        assert (counters in notice(app)) == (size[0] > 100)
        connection.messages.append(
            replace(snapshots[1], statistics=replace(TALLY, distance=None, collisions=None))
        )
        await played(pilot, connection)
        app.notice = ""
        await pilot.pause(0.05)
        assert f"{snapshots[1].involvement} steps with a key" in notice(app)
        assert "collisions" not in shown(app.query_one("#notice"))


@pytest.mark.parametrize("size", [(120, 30), (80, 24)])
async def test_arrivals_and_cost_are_in_the_status_line_of_a_robot_that_has_them(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    app, connection = make_app([facts, replace(snapshots[0], arrivals=2, cost=3.5)])
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        assert "arrived 2  cost 3.5" in shown(app.query_one("#status"))
        assert ("involvement" in shown(app.query_one("#status"))) == (size[0] > 100)
        connection.messages.append(snapshots[1])
        await played(pilot, connection)
        assert "arrived" not in shown(app.query_one("#status"))
        assert "cost" not in shown(app.query_one("#status"))
