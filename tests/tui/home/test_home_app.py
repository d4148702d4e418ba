"""The home screen: what it lists, what enter opens, and where escape leads."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.widgets import OptionList, Static

from pdtui.robots.robot_registry import ListedRobot
from pdtui.sessions.session_header import read_session_header
from pdtui.stimulation.map_library import ListedMap
from pdtui.tui.home.home_app import HomeApp
from pdtui.tui.home.home_contents import HomeContents, read_home_contents
from pdtui.tui.home.home_rows import list_session_rows
from tests.tui.recorded_snapshots import drive_map

ROBOTS = (
    ListedRobot("ant", "Ant (MuJoCo)"),
    ListedRobot("car", problem="robot 'car' needs a package that is not installed"),
    ListedRobot("walker", "Walker (MuJoCo)"),
)
MAPS = (
    ListedMap(Path("maps/ant.toml"), drive_map()),
    ListedMap(Path("maps/ant-imprints.toml"), drive_map()),
    ListedMap(Path("maps/broken.toml"), None, "maps/broken.toml: line 3: [b]behaviors[/b] is missing"),
)
CONTENTS = HomeContents(ROBOTS, MAPS)
WITH_STARTS = HomeContents((ListedRobot("ant", "Ant", ("plane", "forest")),), MAPS[:1])
SAMPLE = Path(__file__).parents[3] / "sessions" / "samples" / "ant.rrd"


def listed(app: HomeApp) -> list[str]:
    return [str(option.prompt).rstrip() for option in app.screen.query_one(OptionList).options]


async def test_everything_is_listed_with_what_is_wrong() -> None:
    app = HomeApp(CONTENTS)
    async with app.run_test(size=(100, 30)):
        rows = "\n".join(listed(app))
    assert "robots" in rows
    assert "Ant (MuJoCo) · 2 maps" in rows
    assert "no map yet: pdtui dissect walker" in rows
    assert "robot 'car' needs a package that is not installed" in rows
    assert "line 3: [b]behaviors[/b] is missing" in rows
    assert "guide" in rows


async def test_enter_opens_a_robot_then_a_map_and_escape_goes_back() -> None:
    app = HomeApp(CONTENTS)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("enter")
        assert len(listed(app)) == 2
        await pilot.press("escape")
        assert "robots" in listed(app)[0]
        await pilot.press("enter", "down", "enter")
    assert app.return_value is not None
    assert (app.return_value.opens, app.return_value.path) == ("drive", "maps/ant-imprints.toml")


async def test_a_robot_with_one_map_and_several_starts_asks_for_the_start() -> None:
    app = HomeApp(WITH_STARTS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("enter", *"forest", "enter")
    assert app.return_value is not None
    assert (app.return_value.opens, app.return_value.start) == ("drive", "forest")


async def test_escape_quits_the_first_list() -> None:
    app = HomeApp(CONTENTS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("escape")
    assert app.return_value is None


async def test_what_cannot_be_opened_cannot_be_chosen() -> None:
    app = HomeApp(CONTENTS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(*"walker", "enter")
        await pilot.press("ctrl+c")
    assert app.return_value is None


async def test_a_filter_that_matches_nothing_says_so() -> None:
    app = HomeApp(CONTENTS)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(*"zzz", "enter")
        await pilot.pause()
        assert "nothing matches" in str(app.screen.query_one("#none").render())
        await pilot.press("ctrl+c")


async def test_a_notice_says_how_the_last_drive_ended() -> None:
    app = HomeApp(CONTENTS, notice="stopped: 12 steps")
    async with app.run_test(size=(80, 24)):
        assert "stopped: 12 steps" in str(app.screen.query_one("#notice", Static).render())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    (tmp_path / "sessions").mkdir()
    return tmp_path


def test_the_contents_are_those_of_the_folders(folder: Path) -> None:
    (folder / "maps").mkdir()
    (folder / "maps" / "ant-dissected.rrd").write_bytes(b"x")
    for number in range(20):
        (folder / "sessions" / f"drive{number:02}.rrd").write_bytes(b"x")
    found = read_home_contents()
    assert {"ant", "walker"} <= {robot.name for robot in found.robots}
    assert found.maps_of("ant")
    assert len(found.sessions) == 12
    assert found.reports == (folder / "maps" / "ant-dissected.rrd",)


async def test_a_session_can_be_watched_or_opened(folder: Path) -> None:
    session = folder / "sessions" / "ant.rrd"
    session.write_bytes(SAMPLE.read_bytes())
    broken = folder / "sessions" / "broken.rrd"
    broken.write_bytes(b"x")
    header = read_session_header(session)
    app = HomeApp(HomeContents((), (), (session, broken)))
    async with app.run_test(size=(120, 24)) as pilot:
        await pilot.press("enter")
        assert f"seed {header.info.seed}" in listed(app)[0]
        await pilot.press("enter")
    assert app.return_value is not None
    assert (app.return_value.opens, app.return_value.path) == ("watch", str(session))
    (row,) = list_session_rows(str(broken))
    assert row.problem
