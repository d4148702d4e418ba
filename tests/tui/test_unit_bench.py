"""The unit bench on the screen: picking, sliders, typing, the stack, and saving."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pdtui.core.units import parse_unit
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stack.stack_layer import PidTuning, StackLayer
from pdtui.tui.strip.unit_picking import UnitPicked
from tests.tui.conftest import MakeApp
from tests.tui.ghost_snapshots import with_ghost
from tests.tui.screens import notice, played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]
SIZES = [(80, 24), (120, 40), (200, 60)]


@pytest.mark.parametrize("size", SIZES)
async def test_a_unit_is_picked_by_keys_and_its_value_is_felt(make_app: MakeApp, size: tuple[int, int]) -> None:
    app, connection = make_app(60)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "right", "right", "enter")
        bench = shown(app.query_one("#bench-units"))
        assert "○ 0:2" in bench
        await pilot.press("right", "right", "left")
        kind, address, value = connection.pressed[-1].split()
        assert (kind, address) == ("unit", "0:2")
        assert len(connection.pressed) == 3
        assert f"● 0:2" in shown(app.query_one("#bench-units"))
        await pilot.press("equals_sign", *"-2.5", "enter")
        assert connection.pressed[-1] == "unit 0:2 -2.5"
        await pilot.press("enter")
        assert connection.pressed[-1] == "free 0:2"
        await pilot.press("escape")
        assert not app.query_one("#bench").display
        await pilot.press("up")
        assert connection.pressed[-1] == "up", "the arrows are the drive's again"
