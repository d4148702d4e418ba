"""No size of the terminal, no order of sizes and no snapshot ends the screen."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.cells import cell_len
from textual.app import App, ComposeResult

from pdtui.core.attributes import Attribute
from pdtui.core.scenery import BoxKind, LineKind, RoadLine, Scenery, Traffic
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, StimulatedUnit
from pdtui.guide.guide_pages import read_guide
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap
from pdtui.tui.guide.guide_app import GuideApp, GuideChooser
from pdtui.tui.help_screen import HelpScreen
from pdtui.tui.home.home_app import HomeApp
from pdtui.tui.home.home_contents import HomeContents
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.style_sheets import DRIVE
from pdtui.tui.widgets.activation_heatmap import ActivationHeatmap
from pdtui.tui.widgets.attribute_table import AttributeTable
from pdtui.tui.widgets.behavior_list import BehaviorList
from pdtui.tui.widgets.path_view import PathView
from pdtui.tui.widgets.robot_view import RobotView
from pdtui.tui.widgets.status_lines import KeyLine, NoticeLine, StatusLine
from pdtui.tui.widgets.unit_table import UnitTable
from tests.tui.conftest import DATA, MakeApp
from tests.tui.recorded_snapshots import drive_map, load
from tests.tui.screens import played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]
PANELS: dict[str, Callable[..., SnapshotWidget]] = {
    "status": StatusLine,
    "robot": RobotView,
    "path": PathView,
    "units": UnitTable,
    "behaviors": BehaviorList,
    "attributes": AttributeTable,
    "heat": ActivationHeatmap,
    "notice": NoticeLine,
    "keys": KeyLine,
}
Size = tuple[int, int]
HOSTILE_SIZES = ((1, 1), (2, 1), (300, 2), (0, 0), (400, 400), (3, 17), (1, 99))
NO_BEHAVIORS = StimulationMap("ant", "p", "0" * 64, "space", {}, {})
SIZES = st.tuples(st.integers(0, 400), st.integers(0, 400)) | st.tuples(st.integers(0, 20), st.integers(0, 5))


class PanelsApp(App[None]):
    """Every widget of the drive's screen with the frame that it has there, each as large as the terminal."""

    CSS = DRIVE + ".panel { width: 100% !important; height: 100% !important; display: block !important; }"

    def __init__(self, stimulation_map: StimulationMap) -> None:
        super().__init__()
        self.map = stimulation_map

    def compose(self) -> ComposeResult:
        for name, kind in PANELS.items():
            yield kind(self.map, id=name)

    def on_mount(self) -> None:
        self.query("SnapshotWidget").add_class("panel")


def all_panels(app: App[Any]) -> list[SnapshotWidget]:
    return [panel for panel in app.query("SnapshotWidget") if isinstance(panel, SnapshotWidget)]


def widened(facts: DriveFacts, snapshot: DriveSnapshot, layers: tuple[int, ...]) -> Drive:
    """The same drive of a policy with other layers, every tenth unit of which is stimulated."""
    units = sum(layers)
    values = np.sin(np.arange(units, dtype=np.float32))
    stimulated = tuple(StimulatedUnit(unit, 0.5, -1.5) for unit in range(0, units, max(1, units // 10)))
    return replace(facts, layers=layers), [replace(snapshot, activations=values, stimulated_units=stimulated)]


@cache
def hostile_drives() -> dict[str, Drive]:
    """Drives by what is odd about them."""
    facts, snapshots = load(DATA)
    stimulated = next(one for one in snapshots if one.stimulated_units)
    first = snapshots[0]

    def filled(value: float) -> DriveSnapshot:
        arrays = {
            name: np.full_like(getattr(first, name), value)
            for name in ("activations", "attributes", "poses", "history", "path")
        }
        return replace(first, **arrays)

    obstacles = np.array([[2.0, 0.0, 0.3], [-1.0, 4.0, 1.0], [0.0, 0.0, 50.0], [1e4, 1e4, 0.1]])
    points = np.array([[-50.0, 2.0], [0.0, 2.0], [1e4, 2.0], [1e4, 2.0]])
    road = Scenery(
        tuple(RoadLine(kind, points + row) for row, kind in enumerate(get_args(LineKind))), obstacles
    )
    kinds: tuple[BoxKind, ...] = ("vehicle", "obstacle", "vehicle")
    places = np.array([[5.0, 1.0, 0.5, 0.3], [0.0, 0.0, 0.0, 0.0], [1e300, 0.0, 0.0, 1.0]])
    sizes = np.array([[4.0, 2.0, 1.0], [0.0, 0.0, 0.0], [1e4, 1e4, 1e4]])
    crowd = Traffic(np.arange(3), kinds, places, sizes, places[:, :2])
    nowhere = Traffic(np.arange(3), kinds, places * np.nan, sizes, places[:, :2] * np.nan)
    bodiless = replace(facts, links=())
    nothing = replace(first, poses=np.empty((0, 7)), path=np.empty((0, 3)))
    return {
        "loaded": (facts, []),
        "first step": (facts, [first]),
        "a while": (facts, snapshots[:20]),
        "stimulated": (facts, [stimulated]),
        "one layer": widened(facts, first, (7,)),
        "wide layers": widened(facts, first, (300_000, 3)),
        "many layers": widened(facts, first, (2,) * 60),
        "nan": (facts, [first, filled(np.nan)]),
        "infinite": (facts, [first, filled(np.inf)]),
        "huge": (facts, [first, filled(1e200)]),
        "largest": (facts, [first, filled(1.7e308)]),
        "zeros": (facts, [filled(0.0)]),
        "obstacles": (
            facts,
            [replace(first, scenery=Scenery(cylinders=obstacles)), replace(stimulated, restarted=True)],
        ),
        "road": (
            facts,
            [replace(filled(np.nan), scenery=road, traffic=nowhere), replace(first, traffic=crowd)],
        ),
        "no body": (bodiless, [nothing]),
        "no attributes": (
            replace(facts, attributes=(), recording="x" * 300),
            [replace(first, attributes=np.empty(0), history=np.empty((3, 0)))],
        ),
        "wide characters": (
            replace(facts, title="蟻" * 99, attributes=(Attribute("速度\x1b[2J", "m/s"),)),
            [replace(first, attributes=np.ones(1), history=np.ones((9, 1)))],
        ),
        "long messages": (facts, [replace(first, notice="\N{COLLISION SYMBOL}" * 300, step=10**12)]),
        "over": (facts, [replace(first, finished="x" * 500)]),
    }


async def paint_everywhere(drive: str, stimulation_map: StimulationMap, sizes: Sequence[Size]) -> None:
    """Let every widget paint a drive at each of the sizes; every line must be as wide as the widget."""
    facts, snapshots = hostile_drives()[drive]
    app = PanelsApp(stimulation_map)
    async with app.run_test(size=sizes[0]) as pilot:
        panels = all_panels(app)
        for panel in panels:
            panel.facts = facts
        for number, size in enumerate(sizes):
            await pilot.resize_terminal(*size)
            while 0 not in size and panels[-1].outer_size != size:
                await pilot.pause(0.01)
            for panel in panels:
                for snapshot in snapshots if number == 0 else snapshots[-1:]:
                    panel.snapshot = snapshot
                columns, rows = panel.outer_size
                lines = panel.render_lines(panel.outer_size.region)
                assert [sum(segment.cell_length for segment in line) for line in lines] == [columns] * rows


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("drive", hostile_drives())
async def test_every_widget_paints_every_drive(drive: str) -> None:
    await paint_everywhere(drive, drive_map(), HOSTILE_SIZES)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@settings(deadline=None, max_examples=8)
@given(drive=st.sampled_from(sorted(hostile_drives())), sizes=st.lists(SIZES, min_size=1, max_size=5))
def test_every_widget_paints_at_every_size(drive: str, sizes: list[Size]) -> None:
    asyncio.run(paint_everywhere(drive, NO_BEHAVIORS, sizes))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@settings(deadline=None, max_examples=500)
@given(
    drive=st.sampled_from(sorted(hostile_drives())),
    stimulation_map=st.sampled_from([drive_map(), NO_BEHAVIORS]),
    sizes=st.lists(SIZES, min_size=1, max_size=5),
)
def test_every_widget_paints_at_many_orders_of_sizes(
    drive: str, stimulation_map: StimulationMap, sizes: list[Size]
) -> None:
    asyncio.run(paint_everywhere(drive, stimulation_map, sizes))


def a_large_map() -> StimulationMap:
    """More behaviors than fit on a screen."""
    behaviors = [
        Behavior(f"behavior {row}", f"f{row}", "says much " * 20, {"0:1": 1.0}, period=0.5)
        for row in range(1, 60)
    ]
    return StimulationMap("ant", "p", "0" * 64, "space", {}, {one.name: one for one in behaviors})


@pytest.mark.parametrize("keys", [[], ["question_mark"]])
async def test_a_drive_survives_every_order_of_sizes(make_app: MakeApp, keys: list[str]) -> None:
    app, connection = make_app(60, a_large_map())
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(*keys)
        for size in (*HOSTILE_SIZES, (1, 1), (300, 2), (80, 24)):
            await pilot.resize_terminal(*size)
            await pilot.pause(0.05)
        await played(pilot, connection)
        if keys:
            assert isinstance(app.screen, HelpScreen)
            await pilot.press("escape")
        assert app.return_code is None
        assert app.query_one("#body").display
        assert "m/s" in shown(app.query_one("#attributes"))
        for panel in all_panels(app):
            if panel.display:
                lines = shown(panel).splitlines()
                assert [cell_len(line) for line in lines] == [panel.outer_size.width] * len(lines)


async def test_the_home_screen_survives_every_order_of_sizes() -> None:
    reports = tuple(Path(f"maps/ant{number}.rrd") for number in range(50))
    app = HomeApp(HomeContents((), (), (), reports))
    async with app.run_test(size=(80, 24)) as pilot:
        for size in (*HOSTILE_SIZES, (80, 24)):
            await pilot.resize_terminal(*size)
            await pilot.press("pagedown", "7", "backspace")
        await pilot.press("7", "down", "enter")
    assert app.return_value is not None
    assert app.return_value.path == "maps/ant17.rrd"


@pytest.mark.parametrize("key", ["", "t"])
async def test_the_guide_survives_every_order_of_sizes(key: str) -> None:
    app = GuideApp(read_guide(), "sessions")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        if key:
            await pilot.press(key)
        for size in (*HOSTILE_SIZES, (80, 24)):
            await pilot.resize_terminal(*size)
            await pilot.press("pagedown")
        if key:
            assert isinstance(app.screen, GuideChooser)
            await pilot.press("escape")
        await pilot.press("right_square_bracket")
        assert app.return_code is None
        assert app.page.topic != "sessions"
