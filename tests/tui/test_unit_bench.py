"""The unit bench on the screen: picking, sliders, typing, the stack, and saving."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.step_record import ActiveBehavior
from pdtui.core.units import parse_unit
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, StimulatedUnit
from pdtui.driving.unit_bench.natural_ranges import NaturalRanges
from pdtui.driving.unit_bench.unit_search_snapshot import FoundUnit, UnitSearchRequest, UnitSearchSnapshot
from pdtui.search.gains.gain_tuning_process import TUNING_SEEDS, GainTuningState, OfferedGains
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stack.stack_entry import PidTuning, StackEntry
from pdtui.tui.drive_app import DriveApp
from pdtui.tui.unit_bench.bench_entry import BenchEntry
from pdtui.tui.unit_bench.unit_page import UnitPage
from tests.tui.conftest import MakeApp, ScriptedConnection
from tests.tui.ghost_snapshots import with_ghost
from tests.tui.screens import notice, played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]
SIZES = [(80, 24), (120, 40), (200, 60)]


@pytest.mark.parametrize("size", SIZES)
async def test_a_unit_is_picked_by_keys_and_its_value_is_felt(
    make_app: MakeApp, size: tuple[int, int]
) -> None:
    app, connection = make_app(60)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "right", "right", "enter")
        bench = shown(app.query_one("#bench-units"))
        assert "○ 0:2" in bench
        await pilot.press("right", "right", "left")
        kind, address, _ = connection.pressed[-1].split()
        assert (kind, address) == ("unit", "0:2")
        assert len(connection.pressed) == 3
        assert "● 0:2" in shown(app.query_one("#bench-units"))
        await pilot.press("equals_sign", *"-2.5", "enter")
        assert connection.pressed[-1] == "unit 0:2 -2.5"
        await pilot.press("enter")
        assert connection.pressed[-1] == "free 0:2"
        await pilot.press("escape")
        assert not app.query_one("#bench").display
        await pilot.press("up")
        assert connection.pressed[-1] == "up", "the arrows are the drive's again"


async def test_a_unit_is_picked_with_the_mouse_in_the_strip_and_dragged(make_app: MakeApp) -> None:
    app, connection = make_app(60)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.click("#heat", offset=(40, 1))
        await pilot.pause(0.05)
        page = app.query_one("#bench-units", UnitPage)
        (row,) = page.units.rows
        assert app.query_one("#bench").display
        await pilot.mouse_down(page, offset=(25, 0))
        await pilot.hover(page, offset=(38, 0))
        await pilot.mouse_up(page, offset=(38, 0))
        kind, address, value = connection.pressed[-1].split()
        assert parse_unit(address, app.facts.layers if app.facts else ()) == row.unit
        assert (kind, float(value), row.held) == ("unit", row.value, True)
        assert len({edit.split()[2] for edit in connection.pressed}) >= 2, "it follows the mouse"


async def test_a_unit_is_picked_with_the_mouse_in_the_table(make_app: MakeApp, drive: Drive) -> None:
    app, connection = make_app(64)
    async with app.run_test(size=(200, 60)) as pilot:
        await played(pilot, connection)
        assert app.snapshot is not None
        unit = app.snapshot.stimulated_units[0].unit
        await pilot.click("#units", offset=(6, 2))
        await pilot.pause(0.05)
        assert [row.unit for row in app.query_one("#bench-units", UnitPage).units.rows] == [unit]


async def test_a_wrong_unit_or_number_is_named(make_app: MakeApp) -> None:
    app, connection = make_app(5)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "equals_sign", *"9:999", "enter")
        assert "unit 9:999 does not exist" in notice(app)
        await pilot.press("escape", "enter", "equals_sign", *"1e999", "enter")
        assert "expected a number" in notice(app)
        assert not connection.pressed


async def test_behaviors_stay_latchable_while_the_bench_has_the_keys(make_app: MakeApp) -> None:
    app, connection = make_app(5)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "w", "space")
        assert connection.pressed == ["w", "space"]


async def test_the_stack_is_edited_by_its_page(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    stack = (
        StackEntry("forward", 1.0, False, (256 + 7, 256 + 40)),
        StackEntry("crouch", 1.5, False, (256 + 3, 256 + 7)),
    )
    app, connection = make_app([facts, replace(snapshots[5], stack=stack)])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "tab")
        page = shown(app.query_one("#bench-layers"))
        lines = page.splitlines()
        assert "crouch" in lines[0]
        assert "×1.50" in lines[0]
        assert "shares 1:7" in lines[0]
        assert "forward" in lines[1]
        await pilot.press("right", "enter", "shift+down", "down", "delete", "down", "enter")
        assert connection.pressed == [
            "factor crouch 1.875",
            "mute crouch",
            "order crouch 0",
            "release forward",
            "beside spin left",
        ]


async def test_gains_are_edited_beside_the_chart(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    held = next(
        n for n, one in enumerate(snapshots) if any(v.target is not None for v in one.active_behaviors)
    )
    layer = StackEntry("heading", 1.0, False, (5,), PidTuning(2.0, 0.1, 0.2, 3.0))
    messages = [replace(one, stack=(layer,)) for one in snapshots[held : held + 20]]
    app, connection = make_app([facts, *messages])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "tab", "tab")
        page = shown(app.query_one("#bench-pid"))
        assert "output" in page
        assert "in the map 0.1" in page, "kd differs"
        await pilot.press("right", "down", "equals_sign", *"0.5", "enter")
        assert connection.pressed == ["kp heading 2.2", "ki heading 0.5"]


class ScriptedTuning:
    """Offers what it is told to, and remembers what it was asked."""

    def __init__(self) -> None:
        self.state: GainTuningState | None = None
        self.asked: list[str] = []

    def tune(self, behavior: str) -> str:
        self.asked.append(behavior)
        return "" if len(self.asked) == 1 else "a tuning is under way"


async def test_gains_are_tuned_taken_and_saved_with_the_maps_comments(
    drive: Drive, map_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "own.toml"
    path.write_text("# my notes\n" + map_path.read_text())
    facts, snapshots = drive
    view = ActiveBehavior("hold heading", None, 1.0, 0.5, 0.1, 0.4, 0.8)

    def latched(step: int, *gains: float) -> DriveSnapshot:
        layer = StackEntry("hold heading", 1.0, False, (5,), PidTuning(*gains))
        return replace(snapshots[0], step=step, active_behaviors=(view,), stack=(layer,))

    own = load_map(path)
    pid = own.behaviors["hold heading"].pid
    assert pid is not None
    better = replace(pid, kp=5.0, ki=0.0, limit=2.0)
    tuning, connection = ScriptedTuning(), ScriptedConnection([facts, latched(1, 2.0, 0.1, 0.05, 3.0)])
    app = DriveApp(connection, own, fps=200, tuning=tuning)
    async with app.run_test(size=(200, 60)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "tab", "tab", *["down"] * 5, "enter", "enter")
        assert tuning.asked == ["hold heading"] * 2
        assert "under way" in notice(app)
        offered = (OfferedGains("found", better, 0.125, 0, 5), OfferedGains("map", pid, 0.25, 2, 5))
        tuning.state = GainTuningState("done", "hold heading", "", 7, 7, offered)
        connection.messages.append(latched(2, 2.0, 0.1, 0.05, 3.0))
        await played(pilot, connection)
        page = shown(app.query_one("#bench-pid"))
        assert "7 controllers tried" in page
        assert "○ found     0.12 5/0/0.05 ±2" in page
        assert "fell 2/5" in page
        await pilot.press("down", "enter")
        edits = ["kp hold heading 5", "ki hold heading 0", "limit hold heading 2"]
        assert connection.pressed == edits
        connection.messages.append(latched(3, 5.0, 0.0, 0.05, 2.0))
        await played(pilot, connection)
        assert "in the map 2" in shown(app.query_one("#bench-pid"))
        await pilot.press("ctrl+s")
        assert f"gains saved in {path}"[:40] in notice(app)
        connection.messages.append(latched(4, 5.0, 0.0, 0.05, 2.0))
        await played(pilot, connection)
        assert "in the map" not in shown(app.query_one("#bench-pid"))
    saved = load_map(path)
    assert saved.behaviors["hold heading"].pid == better
    assert saved.text.startswith("# my notes\n")
    assert saved.seeds == (TUNING_SEEDS,), "the seeds that they were chosen on are noted"


async def test_a_search_is_asked_for_and_its_units_are_held(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    app, connection = make_app([facts, snapshots[5]])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e", "tab", "tab", "tab", "right", "down", "right", "enter")
        assert connection.searched == [UnitSearchRequest(facts.attributes[1].name, -1.0)]
        found = (FoundUnit(12, 2.5, -0.75, False), FoundUnit(256, -1.5, -0.5, True))
        state = UnitSearchSnapshot("done", "", connection.searched[0], 40, 123, 40, found)
        connection.messages.append(replace(snapshots[6], unit_search=state))
        await played(pilot, connection)
        page = shown(app.query_one("#bench-search"))
        assert "0:12" in page
        assert "−0.75" in page
        assert "falls" in page
        assert "123 roll-outs" in page
        await pilot.press("down", "enter")
        assert connection.pressed == ["unit 0:12 2.5"]


async def test_held_units_are_saved_with_what_was_measured_and_comments_are_kept(
    make_app: MakeApp, drive: Drive, map_path: Path, tmp_path: Path
) -> None:
    facts, snapshots = drive
    path = tmp_path / "own.toml"
    path.write_text("# my notes\n" + map_path.read_text())
    held = [replace(one, held_units=((12, 2.5),)) for one in with_ghost(snapshots[:60], 30)]
    app, connection = make_app([facts, *held], load_map(path))
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+e")
        assert "Δ over" in shown(app.query_one("#bench-units"))
        await pilot.press("ctrl+s", *"push", "enter")
        assert "there is a behavior 'push' already" in notice(app)
        app.query_one("#bench-entry", BenchEntry).value = "lean over"
        await pilot.press("enter", "w", "enter")
        assert "key 'w' is taken by 'push'" in notice(app)
        await pilot.press("backspace", "y", "enter")
        assert f"'lean over' is in {path}"[:30] in notice(app)
        await pilot.press("y")
        assert connection.pressed == ["unit 0:12 2.5"]
    saved = load_map(path)
    assert saved.behaviors["lean over"].magnitudes == {"0:12": 2.5}
    assert saved.behaviors["lean over"].key == "y"
    aim = saved.behaviors["lean over"].aim
    assert aim is not None
    assert aim.attribute in [one.name for one in facts.attributes]
    assert saved.text.startswith("# my notes\n")
    assert re.search(r"# Means over \d+ control steps from step \d+ on", saved.text)


async def test_layers_without_room_are_announced_and_scrolled_to(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    layers = (128, 128, 256)
    app, connection = make_app([replace(facts, layers=layers), *snapshots[:3]])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        strip = shown(app.query_one("#heat"))
        assert "layer 0: 128 · layer 1: 128 · 1 more: PgUp PgDn" in strip
        await pilot.press("pagedown", "pagedown")
        assert "layer 1: 128 · layer 2: 256 · 1 more" in shown(app.query_one("#heat"))
        await pilot.press("pageup")
        assert "layer 0: 128" in shown(app.query_one("#heat"))


@pytest.mark.parametrize("size", [(120, 40), (160, 60)])
async def test_nothing_is_drawn_where_there_is_no_unit(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    layers = (128, 256, 128)
    app, connection = make_app([replace(facts, layers=layers), *snapshots[:3]])
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        lines = shown(app.query_one("#heat")).splitlines()[1:-1]
    labels = [line[:4].strip() for line in lines]
    assert [label for label in labels if label] == ["0", "1", "2"]
    assert all("▀" in line for line in lines), "rows that are left go to the layers"


async def test_an_overwritten_cell_is_marked_in_place_and_an_unnatural_output_as_such(
    make_app: MakeApp, drive: Drive
) -> None:
    facts, snapshots = drive
    units = (StimulatedUnit(12, 0.25, 16.6), StimulatedUnit(40, 0.1, 0.5))
    shot = replace(snapshots[5], stimulated_units=units)
    app, connection = make_app([replace(facts, output_bounds=((-1.0, 1.0),) * 2), shot])
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        strip = shown(app.query_one("#heat"))
        assert strip.count("◆") == 2
        assert "0:12 0.25→16.60! (−1.00…1.00)" in strip
        assert "0:40 0.10→0.50 " in strip


@pytest.mark.parametrize(
    ("value", "sizes"),
    [(np.nan, ((81, 25), (3, 17), (1, 1), (80, 24))), (np.inf, ((200, 60),)), (1e300, ((80, 24),))],
)
async def test_odd_numbers_and_tiny_terminals_do_no_harm(
    make_app: MakeApp, drive: Drive, value: float, sizes: tuple[tuple[int, int], ...]
) -> None:
    facts, snapshots = drive
    first = snapshots[0]
    arrays = {
        name: np.full_like(getattr(first, name), value) for name in ("activations", "attributes", "history")
    }
    odd = ActiveBehavior("heading", None, 1.0, value, value, value, value)
    shot = replace(
        first,
        **arrays,
        active_behaviors=(odd,),
        stack=(StackEntry("heading", value, False, (5,), PidTuning(value, value, value, value)),),
        held_units=((5, value),),
        natural_ranges=NaturalRanges(arrays["activations"], arrays["activations"], 1000),
        unit_search=UnitSearchSnapshot("done", best=(FoundUnit(5, value, value, True),)),
    )
    app, connection = make_app([facts, *(replace(shot, step=step) for step in range(1, 6))])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        for size in sizes:
            await pilot.resize_terminal(*size)
            for _ in range(4):
                await pilot.press(*(["ctrl+e"] if not app.query_one("#bench").display else []), "tab")
                await pilot.press("up", "right", "down", "left", "enter", "pagedown", "shift+up", "delete")
        assert app.is_running
