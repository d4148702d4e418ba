"""The picker: rows, filter, and maps that are broken."""

from __future__ import annotations

from pathlib import Path

from textual.widgets import OptionList

from pdtui.stimulation.map_library import ListedMap
from pdtui.tui.map_picker import MapPickerApp, MapPickerRow, map_picker_rows
from tests.tui.recorded_snapshots import drive_map

ROWS = [
    MapPickerRow(
        "ant", "", "maps/broken.toml", problem="maps/broken.toml: line 3: [b]behaviors[/b] is missing"
    ),
    MapPickerRow("ant", "Ant (MuJoCo)", "maps/ant.toml", "ant_sac", 5),
    MapPickerRow("walker", "Walker", "maps/walker.toml", "walker_sac", 1),
]


def listed(app: MapPickerApp) -> list[str]:
    return [str(option.prompt) for option in app.query_one(OptionList).options]


async def test_the_first_whole_map_is_marked_and_enter_takes_it() -> None:
    app = MapPickerApp(ROWS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("enter")
    assert app.return_value == ROWS[1]
    assert str(app.return_value) == "maps/ant.toml"


async def test_arrows_move_past_a_broken_map() -> None:
    app = MapPickerApp([ROWS[1], ROWS[0], ROWS[2]])
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("down", "enter")
    assert app.return_value == ROWS[2]


async def test_a_broken_map_shows_its_error_and_cannot_be_chosen() -> None:
    app = MapPickerApp(ROWS[:1])
    async with app.run_test(size=(80, 24)) as pilot:
        assert "line 3: [b]behaviors[/b] is missing" in listed(app)[0]
        await pilot.press("enter")
        await pilot.click(OptionList, offset=(5, 1))
        await pilot.press("ctrl+c")
    assert app.return_value is None


async def test_typing_filters() -> None:
    app = MapPickerApp(ROWS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(*"walk")
        await pilot.pause()
        assert len(listed(app)) == 1
        await pilot.press("enter")
    assert app.return_value == ROWS[2]


async def test_a_filter_that_matches_nothing_says_so() -> None:
    app = MapPickerApp(ROWS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(*"zzz", "enter")
        await pilot.pause()
        assert "nothing matches" in str(app.query_one("#none").render())
        await pilot.press("ctrl+c")
    assert app.return_value is None


def test_rows_of_maps_as_they_are_found() -> None:
    maps = [
        ListedMap(Path("maps/ant.toml"), drive_map()),
        ListedMap(Path("maps/x.toml"), None, "it is empty"),
    ]
    good, bad = map_picker_rows(maps)
    assert (good.robot, good.policy, good.behaviors, good.problem) == ("ant", "ant_sac", 5, "")
    assert (str(bad), bad.problem) == ("maps/x.toml", "it is empty")
