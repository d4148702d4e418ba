"""Whole screens as pictures, from a recorded drive."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest
from textual.pilot import Pilot

from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, StimulatedUnit
from pdtui.tui.home.home_app import HomeApp
from tests.tui.conftest import MakeApp, ScriptedConnection
from tests.tui.ghost_snapshots import with_ghost
from tests.tui.home.test_home_app import CONTENTS
from tests.tui.screens import played

Compare = Callable[..., bool]
SMALL, LARGE = (80, 24), (160, 48)


def after(connection: ScriptedConnection, *keys: str) -> Callable[[Pilot[Any]], Awaitable[None]]:
    async def run(pilot: Pilot[Any]) -> None:
        await played(pilot, connection)
        await pilot.press(*keys)
        await pilot.pause(0.05)

    return run


@pytest.mark.parametrize("size", [SMALL, LARGE], ids=["small", "large"])
def test_loading(snap_compare: Compare, make_app: MakeApp, size: tuple[int, int]) -> None:
    app, _ = make_app([])
    assert snap_compare(app, terminal_size=size)


@pytest.mark.parametrize("size", [SMALL, LARGE], ids=["small", "large"])
@pytest.mark.parametrize("snapshots", [64, 120], ids=["period", "controller"])
def test_driving(snap_compare: Compare, make_app: MakeApp, size: tuple[int, int], snapshots: int) -> None:
    app, connection = make_app(snapshots)
    assert snap_compare(app, terminal_size=size, run_before=after(connection))


@pytest.mark.parametrize("size", [SMALL, LARGE], ids=["small", "large"])
def test_ghost(
    snap_compare: Compare,
    make_app: MakeApp,
    drive: tuple[DriveFacts, list[DriveSnapshot]],
    size: tuple[int, int],
) -> None:
    facts, snapshots = drive
    app, connection = make_app([facts, *with_ghost(snapshots[:64], 40)])
    assert snap_compare(app, terminal_size=size, run_before=after(connection))


@pytest.mark.parametrize("size", [SMALL, (120, 40)], ids=["small", "medium"])
def test_unit_bench(
    snap_compare: Compare,
    make_app: MakeApp,
    drive: tuple[DriveFacts, list[DriveSnapshot]],
    size: tuple[int, int],
) -> None:
    facts, snapshots = drive
    held = StimulatedUnit(12, 0.25, 2.5)
    last = [
        replace(one, held_units=((12, 2.5),), stimulated_units=(held,), active_behaviors=())
        for one in with_ghost(snapshots[:64], 40)
    ]
    app, connection = make_app([replace(facts, output_bounds=((-1.0, 1.0),) * 2), *last])
    assert snap_compare(app, terminal_size=size, run_before=after(connection, "ctrl+e"))


def test_from_above(snap_compare: Compare, make_app: MakeApp) -> None:
    app, connection = make_app(64)
    assert snap_compare(app, terminal_size=LARGE, run_before=after(connection, "v"))


def test_over(
    snap_compare: Compare, make_app: MakeApp, drive: tuple[DriveFacts, list[DriveSnapshot]]
) -> None:
    facts, snapshots = drive
    last = replace(snapshots[40], finished="the simulation diverged", paused=True)
    app, connection = make_app([facts, *snapshots[:40], last])
    assert snap_compare(app, terminal_size=SMALL, run_before=after(connection))


def test_help(snap_compare: Compare, make_app: MakeApp) -> None:
    app, connection = make_app(4)
    assert snap_compare(app, terminal_size=SMALL, run_before=after(connection, "question_mark"))


def test_too_small(snap_compare: Compare, make_app: MakeApp) -> None:
    app, connection = make_app(4)
    assert snap_compare(app, terminal_size=(70, 20), run_before=after(connection))


def test_home(snap_compare: Compare) -> None:
    assert snap_compare(HomeApp(CONTENTS), terminal_size=SMALL)
