"""Everything that follows from a row of the key table does follow from it."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from pdtui.core.drive_events import DriveEvent, describe_event
from pdtui.core.errors import MapError
from pdtui.core.reserved_keys import EVENT_WORDINGS, KEY_TABLE, RUN_KEYS, ReservedKey
from pdtui.core.robot_links_and_state import ManualControl
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.keystrokes import interpret_key, list_drive_keys
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import displayed_key_name
from pdtui.tui.help_screen import HelpScreen
from tests.tui.conftest import MakeApp
from tests.tui.screens import played

Drive = tuple[DriveFacts, list[DriveSnapshot]]


@pytest.fixture(scope="module")
def driven(policy: Policy, small_map: StimulationMap) -> ControlLoop:
    """A loop in a state in which every key means something."""
    robot = make_robot("ant")
    robot.manual_controls = (ManualControl("first hip", 0, "lengthways"),)
    loop = ControlLoop(robot, policy, small_map, 3)
    while loop.step < 75:
        loop.advance()
    loop.advance([DriveEvent(75, "behavior", "hold heading", key="h")])
    return loop


@pytest.mark.parametrize("row", KEY_TABLE, ids=lambda row: row.id)
def test_a_map_may_not_use_the_key(row: ReservedKey, map_text: str) -> None:
    with pytest.raises(
        MapError, match=f"behavior 'twitch': key '{re.escape(row.key)}' is taken: it {row.says}"
    ):
        parse_map(map_text.replace('key = "t"', f'key = "{row.key}"'), "small.toml")


@pytest.mark.parametrize("row", RUN_KEYS.values(), ids=lambda row: row.id)
def test_a_key_that_changes_a_run_makes_its_event(
    row: ReservedKey, driven: ControlLoop, small_map: StimulationMap
) -> None:
    event = interpret_key(row.key, driven)
    assert isinstance(event, DriveEvent)
    assert (event.kind, event.key, event.step) == (row.event, row.key, driven.step)
    assert row.key in list_drive_keys(small_map)


def test_every_event_is_worded() -> None:
    said = {kind: describe_event(DriveEvent(7, kind, "spin", 40.0)) for kind in EVENT_WORDINGS}
    assert all(said.values())
    assert said["rewind"] == "rewound to step 40"
    assert said["factor"] == "magnitudes of 'spin' set to 40 times the map's"


async def test_the_help_lists_every_key_with_its_sentence(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    app, connection = make_app([replace(facts, manual_controls=("steering",)), snapshots[0]])
    async with app.run_test(size=(120, 90)) as pilot:
        await played(pilot, connection)
        await pilot.press("question_mark")
        assert isinstance(app.screen, HelpScreen)
        lines = [strip.text for strip in app.screen._compositor.render_strips()]
    for row in KEY_TABLE:
        assert any(f" {displayed_key_name(row.key)} " in line and row.says in line for line in lines), row.id
