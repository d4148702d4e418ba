"""The ghost on the screen: what its key does, and what the panes say and draw of it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.attributes import wrap_angle
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.ghost.ghost_snapshot import GhostSnapshot
from pdtui.tui.cell_text import format_number, format_signed
from pdtui.tui.widgets.path_view import PathView
from tests.tui.conftest import MakeApp
from tests.tui.ghost_snapshots import with_ghost
from tests.tui.screens import notice, played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]
SINCE = 30
SIZES = [(80, 24), (120, 40), (160, 48)]


async def test_its_key_turns_it_on_and_off_even_beside_a_recording(make_app: MakeApp) -> None:
    app, connection = make_app(3, watching=True)
    async with app.run_test() as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+g", "ctrl+g")
        assert (connection.toggled, connection.pressed) == (2, [])


async def test_its_key_waits_for_the_policy(make_app: MakeApp) -> None:
    app, connection = make_app([])
    async with app.run_test() as pilot:
        await pilot.press("ctrl+g")
        assert connection.toggled == 0
        await pilot.pause(0.05)
        assert "still loading" in notice(app)


@pytest.mark.parametrize("size", SIZES)
async def test_the_table_says_now_without_and_the_difference(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    played_back = with_ghost(snapshots[:60], SINCE)
    app, connection = make_app([facts, *played_back])
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        table = shown(app.query_one("#attributes"))
    moment = played_back[-1].ghost.latest if played_back[-1].ghost is not None else None
    assert moment is not None
    yaw = [attribute.name for attribute in facts.attributes].index("yaw")
    now, without = float(moment.drive_attributes[yaw]), float(moment.attributes[yaw])
    lines = table.splitlines()
    (row,) = [number for number, line in enumerate(lines) if re.match(r"│ yaw +[−\d]", line)]
    assert format_number(now) in lines[row]
    assert format_number(without) in lines[row + 1]
    assert f"Δ{format_signed(wrap_angle(now - without))}" in lines[row + 1]
    assert lines[row + 1][2:].startswith("without")
    assert f"ghost since step {played_back[SINCE].ghost.first}" in lines[0]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("ghost", "said"),
    [
        (GhostSnapshot("loading"), "ghost: loading"),
        (GhostSnapshot("waiting"), "ghost: waits for a behavior"),
        (GhostSnapshot("starting", first=4), "ghost: starting"),
        (GhostSnapshot("failed", "no ghost: it was killed by SIGKILL"), "no ghost: it was killed by SIGKILL"),
    ],
)
async def test_the_screen_says_why_there_is_no_ghost_yet_or_no_more(
    make_app: MakeApp, drive: Drive, ghost: GhostSnapshot, said: str
) -> None:
    facts, snapshots = drive
    app, connection = make_app([facts, *snapshots[:5], replace(snapshots[5], ghost=ghost)])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        assert said in shown(app.query_one("#attributes"))


async def test_a_ghost_that_lags_or_is_over_says_so(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    *before, last = with_ghost(snapshots[:50], SINCE)
    assert last.ghost is not None
    late = replace(last, step=last.step + 17)
    fell = replace(late, ghost=replace(last.ghost, condition="over", message="fell: leans by 61°"))
    app, connection = make_app([facts, *before, last, late])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        table = shown(app.query_one("#attributes"))
        assert "ghost: 17 steps behind" in table
        assert "Δ" in table
        connection.messages.append(fell)
        await played(pilot, connection)
        table = shown(app.query_one("#attributes"))
        assert "ghost: fell: leans by 61°" in table
        assert "Δ" not in table


async def test_a_ghost_outside_the_picture_is_pointed_to(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    *before, last = with_ghost(snapshots[:50], SINCE)
    assert last.ghost is not None
    assert last.ghost.latest is not None
    away = last.poses.copy()
    away[:, 0] += 31.5
    near, far = (
        replace(last, ghost=replace(last.ghost, latest=replace(last.ghost.latest, poses=poses)))
        for poses in (last.poses, away)
    )
    app, connection = make_app([facts, *before, near])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        assert "ghost" not in shown(app.query_one("#robot"))
        connection.messages.append(far)
        await played(pilot, connection)
        assert "ghost 31.50 m ▶" in shown(app.query_one("#robot"))
        gone = replace(far, ghost=None)
        connection.messages.append(gone)
        await played(pilot, connection)
        assert "ghost" not in shown(app.query_one("#robot"))


async def test_the_path_has_the_ghosts_and_forgets_it_with_the_ghost(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    played_back = with_ghost(snapshots[:50], SINCE)
    app, connection = make_app([facts, *played_back])
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        assert "◌" in shown(app.query_one("#path"))
        connection.messages.append(replace(snapshots[50], ghost=None))
        await played(pilot, connection)
        assert "◌" not in shown(app.query_one("#path"))


async def test_a_ghost_whose_pose_is_not_finite_is_not_drawn(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    *before, last = with_ghost(snapshots[:50], SINCE)
    assert last.ghost is not None
    assert last.ghost.latest is not None
    moment = replace(
        last.ghost.latest,
        poses=np.full_like(last.poses, np.nan),
        attributes=np.full_like(last.attributes, np.nan),
    )
    broken = replace(last.ghost, latest=moment, history=np.full_like(last.history, np.inf))
    app, connection = make_app([facts, *before, replace(last, ghost=broken)])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        assert "nan" in shown(app.query_one("#attributes"))


async def test_zooming_shows_less_or_more_of_the_path(make_app: MakeApp) -> None:
    app, connection = make_app(60)
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        path = app.query_one(PathView)
        titles = [str(path.border_title)]
        for key in ("right_square_bracket", *["left_square_bracket"] * 5):
            await pilot.press(key)
            titles.append(str(path.border_title))
        assert titles == [
            f"path · {which}"
            for which in (
                "last 20 s",
                "last 10 s",
                "last 20 s",
                "last 40 s",
                "last 80 s",
                "all of it",
                "all of it",
            )
        ]
