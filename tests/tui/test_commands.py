"""The command palette, clicks, the user's keys and themes, on a recorded drive."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from rich.style import Style
from textual.color import Color
from textual.command import CommandList
from textual.events import Click
from textual.widgets import Input

from pdtui.core.errors import SettingsError
from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.core.settings.settings_file import read_settings
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, PastPosition
from pdtui.tui.commands.palette_commands import list_palette_commands
from pdtui.tui.drive_app import DriveApp
from pdtui.tui.theme import STYLES, THEME
from pdtui.tui.themes.legible_colors import contrast_ratio
from pdtui.tui.themes.themed_app import list_themes
from pdtui.tui.widgets.behavior_list import BehaviorList
from pdtui.tui.widgets.path_view import PathView
from pdtui.tui.widgets.robot_view import RobotView
from pdtui.tui.widgets.status_lines import KeyLine
from tests.tui.conftest import MakeApp
from tests.tui.screens import notice, played, shown


async def test_the_palette_latches_a_behavior_and_keeps_the_maps_keys_out(make_app: MakeApp) -> None:
    app, connection = make_app()
    spin = next(iter(app.map.behaviors.values()))
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+p")
        assert app.choosing_command
        await pilot.press(*spin.name.replace(" ", ""))
        await pilot.pause(0.5)
        assert app.screen.query_one(Input).value == spin.name.replace(" ", "")
        assert connection.pressed == []
        await pilot.press("enter")
        await pilot.pause(0.2)
        assert connection.pressed == [spin.key]
        await pilot.press("ctrl+p")
        await pilot.press("escape")
        await pilot.pause(0.2)
        assert not app.choosing_command


async def test_a_palette_that_is_closed_twice_at_once_leaves_the_drive(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+p")
        await pilot.press(*"help")
        await pilot.pause(0.5)
        for _ in range(2):  # a second one before the first has closed the palette
            app.screen.post_message(Click(app.screen, 0, 0, 0, 0, 1, False, False, False, 0, 0))
        await pilot.pause(0.3)
        assert not app.choosing_command
        await pilot.press(next(iter(app.map.behaviors.values())).key)
        assert len(connection.pressed) == 1


async def test_a_palette_opens_while_the_one_before_closes(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+p")
        app.pop_screen()
        app.action_command_palette()
        await pilot.pause(0.5)
        assert app.choosing_command


async def test_a_palette_that_fails_closes_and_the_drive_goes_on(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+p")
        await app.screen.query_one(CommandList).remove()  # as it is gone while the palette closes
        await pilot.press("a")
        await pilot.pause(0.3)
        assert not app.choosing_command
        await pilot.press(next(iter(app.map.behaviors.values())).key)
        assert len(connection.pressed) == 1


async def test_the_palette_lists_behaviors_keys_and_themes(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        names = [command.name for command in list_palette_commands(app)]
    assert {f"latch {name}" for name in app.map.behaviors} < set(names)
    keys = {row.id.replace("_", " ") for row in KEY_TABLE if row.id not in ("palette", "takeover")}
    assert keys < set(names)  # this robot cannot be taken over
    assert {"screenshot", "theme nord", "theme pdtui"} < set(names)


async def test_a_screenshot_is_written_where_pdtui_runs(
    make_app: MakeApp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        app.action_save_screen()
        await pilot.pause(0.5)
        (picture,) = tmp_path.glob("pdtui-*.svg")
        assert f"wrote ./{picture.name}" in notice(app) or picture.name in notice(app)
    assert "behaviors" in picture.read_text()


async def test_escape_goes_back_from_one_thing_after_the_other_and_never_ends_the_drive(
    make_app: MakeApp, drive: tuple[DriveFacts, list[DriveSnapshot]]
) -> None:
    facts, snapshots = drive
    past = replace(snapshots[2], past=PastPosition(snapshots[3].step, 0))
    app, connection = make_app([facts, snapshots[3], past])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        assert "esc back" in shown(app.query_one(KeyLine))
        await pilot.press("ctrl+f", "ctrl+e", "escape")
        assert not app.query_one("#bench").display
        assert app.query_one("#spectra").display
        await pilot.press("escape")
        assert not app.query_one("#spectra").display
        await pilot.press("escape")
        assert connection.sought == [snapshots[3].step], "the present"
        connection.messages.append(snapshots[4])
        await played(pilot, connection)
        assert "esc back" not in shown(app.query_one(KeyLine))
        await pilot.press("escape", "escape")
        assert "nothing is open; q ends the drive" in notice(app)
        assert app.is_running


async def test_clicks_latch_clear_and_press_keys(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        rows = shown(app.query_one(BehaviorList)).splitlines()
        for name, behavior in app.map.behaviors.items():
            line = next(number for number, row in enumerate(rows) if f" {name}" in row)
            await pilot.click(BehaviorList, offset=(10, line))
            assert connection.pressed[-1] == behavior.key
        line = next(number for number, row in enumerate(rows) if "clears all" in row)
        await pilot.click(BehaviorList, offset=(10, line))
        assert connection.pressed[-1] == app.map.default_key
        where = shown(app.query_one(KeyLine)).index("pause")
        await pilot.click(KeyLine, offset=(where, 0))
        assert connection.paced == ["pause"]
        await pilot.click(RobotView)
        assert app.query_one(RobotView).view == "above"


async def test_the_wheel_zooms_the_path(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        path = app.query_one(PathView)
        before = path.stretch
        path.on_mouse_scroll_down()
        assert path.stretch == before + 1
        path.on_mouse_scroll_up()
        assert path.stretch == before


async def test_the_users_keys_do_what_they_are_for(make_app: MakeApp) -> None:
    made, connection = make_app()
    app = DriveApp(connection, made.map, fps=200, keymap={"pause": "f5", "reset": "t"})
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("f5")
        assert connection.paced == ["pause"]
        await pilot.press("p")
        assert connection.paced == ["pause"]
        assert "no behavior has the key p" in notice(app)


async def test_a_key_that_the_map_has_for_itself_is_named(make_app: MakeApp) -> None:
    made, connection = make_app()
    key = next(iter(made.map.behaviors.values())).key
    app = DriveApp(connection, made.map, fps=200, keymap={"pause": key})
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        assert f"keys of your settings that the map has for itself: {key} (pause)" in notice(app)


async def test_a_theme_changes_every_pane_at_once(make_app: MakeApp) -> None:
    app, connection = make_app()
    try:
        async with app.run_test(size=(120, 40)) as pilot:
            await played(pilot, connection)
            app.theme = "textual-light"
            await pilot.pause(0.3)
            styles = _styles(app.query_one(BehaviorList)) | _styles(app.query_one(PathView))
            dark = {style.bgcolor.get_truecolor() for style in styles if style.bgcolor is not None}
            assert min(sum(color) for color in dark) > 300
            await pilot.press("question_mark")
            await pilot.pause(0.1)
            assert "behaviors" in app.export_screenshot()
    finally:
        STYLES.adopt(THEME)


def _styles(widget: BehaviorList | PathView) -> set[Style]:
    lines = widget.render_lines(widget.outer_size.region)
    return {
        segment.style
        for strip in lines
        for segment in strip
        if segment.style is not None and segment.text.strip()
    }


@pytest.mark.parametrize("name", list_themes())
def test_everything_can_be_read_in_every_theme(name: str) -> None:
    try:
        STYLES.adopt(list_themes()[name])
        assert STYLES.base.bgcolor is not None
        back = Color.from_rich_color(STYLES.base.bgcolor)
        texts = [
            STYLES.text,
            STYLES.title,
            STYLES.primary,
            STYLES.accent,
            STYLES.good,
            STYLES.warn,
            STYLES.bad,
        ]
        for style, least in [
            *((style, 4.4) for style in (*texts, *STYLES.behaviors)),
            *((style, 2.9) for style in (STYLES.below, STYLES.ghost)),
            (STYLES.muted, 4.1),
            (STYLES.faint, 1.9),
        ]:
            assert style.color is not None
            assert contrast_ratio(Color.from_rich_color(style.color), back) >= least
        for style in (STYLES.key, STYLES.alert, *STYLES.caps):
            assert style.color is not None
            assert style.bgcolor is not None
            text, on = Color.from_rich_color(style.color), Color.from_rich_color(style.bgcolor)
            assert contrast_ratio(text, on) >= 4.4
        zero, warm, cold = (STYLES.heat[index] for index in (len(STYLES.heat) // 2, -1, 0))
        assert contrast_ratio(zero, warm) >= 2.0
        assert contrast_ratio(zero, cold) >= 2.0
    finally:
        STYLES.adopt(THEME)


async def test_a_theme_is_saved_by_the_palette(
    make_app: MakeApp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        for command in ("themenord", "savetheme"):
            await pilot.press("ctrl+p", *command)
            await pilot.pause(0.5)
            await pilot.press("enter")
            await pilot.pause(0.2)
        assert "theme nord is in" in notice(app)
    assert read_settings().theme == "nord"


def test_a_theme_that_does_not_exist_is_refused(make_app: MakeApp) -> None:
    made, connection = make_app()
    with pytest.raises(SettingsError, match="no theme 'nope'; available: pdtui, textual-dark"):
        DriveApp(connection, made.map, theme="nope")
