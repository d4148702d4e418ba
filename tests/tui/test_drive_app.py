"""The drive's application: what it shows, and where its keys go."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import PdtuiError
from pdtui.core.reserved_keys import RESERVED_KEYS
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap
from pdtui.tui.commands.key_bound_app import BINDINGS
from pdtui.tui.help_screen import HelpScreen
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.widgets.robot_view import RobotView
from tests.tui.conftest import MakeApp
from tests.tui.recorded_snapshots import drive_map
from tests.tui.screens import notice, played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]


def test_importing_the_screen_loads_no_heavy_library() -> None:
    code = (
        "import sys, pdtui.tui.drive_app, pdtui.tui.home.home_app;"
        "print([m for m in ('torch', 'mujoco', 'gymnasium', 'rerun', 'scipy') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


async def test_first_frame_shows_the_behaviors_before_the_policy_is_there(make_app: MakeApp) -> None:
    app, _ = make_app([])
    async with app.run_test(size=(80, 24)):
        assert "loading the policy" in shown(app.query_one("#robot"))
        behaviors = shown(app.query_one("#behaviors"))
        assert all(name in behaviors for name in drive_map().behaviors)


async def test_keys_of_the_map_go_to_the_drive(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("w", "h", "space")
        assert connection.pressed == ["w", "h", "space"]


async def test_keys_that_change_the_run_go_to_the_drive(make_app: MakeApp) -> None:
    app, connection = make_app()
    keys = ["up", "down", "left", "right", "plus", "minus", "r", "backspace"]
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press(*keys)
        assert connection.pressed == keys


async def test_keys_of_the_pace_go_to_the_pacer(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("p", "n", "comma", "full_stop")
        assert connection.paced == ["pause", "step", "slower", "faster"]
        assert connection.pressed == []


def test_every_reserved_key_is_bound() -> None:
    assert {binding.key for binding in BINDINGS} >= set(RESERVED_KEYS)


async def test_a_behavior_comes_before_the_applications_own_key(make_app: MakeApp) -> None:
    stimulation_map = drive_map()
    stimulation_map.behaviors["wave"] = Behavior("wave", "v", "waves", {"0:1": 1.0})
    app, connection = make_app(3, stimulation_map)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("v")
        assert connection.pressed == ["v"]
        assert app.query_one(RobotView).view == "side"
        assert "view" not in app.keys_now


async def test_a_key_that_nobody_has_is_named(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("z")
        assert "no behavior has the key z" in notice(app)
        assert connection.pressed == []


async def test_keys_before_the_policy_is_there_are_refused(make_app: MakeApp) -> None:
    app, connection = make_app([])
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("w")
        assert "still loading" in notice(app)
        assert connection.pressed == []


async def test_watching_refuses_keys_that_change_the_run(make_app: MakeApp) -> None:
    app, connection = make_app(3, watching=True)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press("w")
        assert "keys cannot change it" in notice(app)
        await pilot.press("r", "p")
        assert connection.pressed == []
        assert connection.paced == ["pause"]
        assert "watching" in shown(app.query_one("#status"))


async def test_a_remapped_key_still_sends_the_original(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        app.set_keymap({"reset": "f5", "pause": "f6"})
        await pilot.press("f5", "f6")
        assert (connection.pressed, connection.paced) == (["r"], ["pause"])
        await pilot.press("r")
        assert connection.pressed == ["r"]
        assert "f6 pause" in shown(app.query_one("#keys"))


async def test_the_view_toggles(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        side = shown(app.query_one("#robot"))
        await pilot.press("v")
        above = shown(app.query_one("#robot"))
        assert "robot · side" in side
        assert "robot · above" in above
        await pilot.press("v")
        assert shown(app.query_one("#robot")) == side


async def test_help_lists_all_keys_and_the_drive_goes_on(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(100, 60)) as pilot:
        await played(pilot, connection)
        await pilot.press("question_mark")
        assert isinstance(app.screen, HelpScreen)
        text = str(app.screen.query_one("Static").render())
        for behavior in drive_map().behaviors.values():
            assert behavior.says in text
        for binding in BINDINGS:
            # The Ant has no controls to take over.
            assert (binding.description in text) == (binding.id != "takeover")
        await pilot.press("space")
        assert connection.pressed == ["space"]
        await pilot.press("question_mark")
        assert not isinstance(app.screen, HelpScreen)


async def test_a_takeover_is_offered_and_shown_where_the_robot_has_controls(
    make_app: MakeApp, drive: Drive
) -> None:
    facts, snapshots = drive
    app, connection = make_app()
    async with app.run_test(size=(160, 48)) as pilot:
        await played(pilot, connection)
        assert "take over" not in shown(app.query_one("#keys"))
    steered = replace(facts, manual_controls=("steering", "throttle"))
    manual = replace(snapshots[1], manual=(("steering", -0.3), ("throttle", 0.5)), notice="")
    for size in ((80, 24), (160, 48)):
        app, connection = make_app([steered, snapshots[0]])
        async with app.run_test(size=size) as pilot:
            await played(pilot, connection)
            assert "⏎ take over" in shown(app.query_one("#keys"))
            assert "manual" not in shown(app.query_one("#status"))
            await pilot.press("enter", "left")
            assert connection.pressed == ["enter", "left"]
            await pilot.press("question_mark")
            connection.messages += [steered, manual]  # facts come again when the recording is created
            await played(pilot, connection)
            await pilot.press("question_mark")
            assert "manual: steering −0.30  throttle 0.50" in shown(app.query_one("#status"))
            assert f"{manual.involvement} steps with a key or a takeover (" in notice(app)


async def test_a_terminal_that_is_too_small_says_so_and_recovers(make_app: MakeApp) -> None:
    app, connection = make_app()
    async with app.run_test(size=(60, 20)) as pilot:
        await played(pilot, connection)
        message = shown(app.query_one("#too-small"))
        assert "need 80 × 24" in message
        assert "have 60 × 20" in message
        assert not app.query_one("#body").display
        await pilot.press("space")
        assert connection.pressed == ["space"]
        await pilot.resize_terminal(80, 24)
        await pilot.pause(0.05)
        assert app.query_one("#body").display
        assert "m/s" in shown(app.query_one("#attributes"))
        await pilot.resize_terminal(79, 24)
        await pilot.pause(0.05)
        assert "have 79 × 24" in shown(app.query_one("#too-small"))


async def test_the_end_of_the_drive_stays_on_the_screen(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    last = replace(snapshots[2], finished="the simulation diverged at 3.20 s", notice="fell")
    app, connection = make_app([facts, *snapshots[:2], last])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        assert "the drive is over: the simulation diverged at 3.20 s" in notice(app)
        assert "q quits" in notice(app)
        assert "m/s" in shown(app.query_one("#attributes"))
        await pilot.press("w")
        assert connection.pressed == []
        await pilot.press("q")
    assert app.return_code == 0


async def test_a_failed_drive_ends_the_application_with_its_message(make_app: MakeApp, drive: Drive) -> None:
    message = "the simulation's process ended with code -9"
    app, _ = make_app([drive[0], PdtuiError(message)])
    async with app.run_test(size=(80, 24)) as pilot:
        for _ in range(1000):
            if app.return_code is not None:
                break
            await pilot.pause(0.005)
    assert (app.return_code, app.return_value) == (1, message)


@pytest.mark.parametrize("key", ["q", "ctrl+c"])
async def test_quitting(make_app: MakeApp, key: str) -> None:
    app, connection = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        await pilot.press(key)
        await pilot.pause()
    assert (app.return_code, app.return_value) == (0, None)


async def test_a_notice_of_the_drive_is_shown(make_app: MakeApp, drive: Drive) -> None:
    app, connection = make_app([drive[0], replace(drive[1][0], notice="fell: on its back \x1b[31m[b]x")])
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        assert "fell: on its back \N{REPLACEMENT CHARACTER}[31m[b]x" in notice(app)


async def test_text_of_a_map_is_neither_markup_nor_control(make_app: MakeApp) -> None:
    stimulation_map = drive_map()
    stimulation_map.behaviors["odd"] = Behavior("[red]odd\x07", "o", "[link=x]says\x1b[2J", {"0:1": 1.0})
    app, connection = make_app(2, stimulation_map)
    async with app.run_test(size=(160, 48)) as pilot:
        await played(pilot, connection)
        behaviors = shown(app.query_one("#behaviors"))
        assert "[red]odd\N{REPLACEMENT CHARACTER}" in behaviors
        assert "[link=x]says\N{REPLACEMENT CHARACTER}[2J" in behaviors
        await pilot.press("question_mark")
        assert "[red]odd" in str(app.screen.query_one("Static").render())


async def test_poses_that_are_not_finite_are_said(make_app: MakeApp, drive: Drive) -> None:
    broken = replace(
        drive[1][0],
        poses=np.full_like(drive[1][0].poses, np.nan),
        activations=np.full_like(drive[1][0].activations, np.nan),
        attributes=np.full_like(drive[1][0].attributes, np.nan),
        history=np.full_like(drive[1][0].history, np.nan),
        path=np.full_like(drive[1][0].path, np.nan),
    )
    app, connection = make_app([drive[0], broken])
    async with app.run_test(size=(160, 48)) as pilot:
        await played(pilot, connection)
        assert "not finite" in shown(app.query_one("#robot"))


@pytest.mark.parametrize("size", [(80, 24), (160, 48), (70, 20)])
async def test_without_colors(
    monkeypatch: pytest.MonkeyPatch, make_app: MakeApp, size: tuple[int, int]
) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    app, connection = make_app(64)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        for panel in app.query("SnapshotWidget").results():
            assert isinstance(panel, SnapshotWidget)
            for segment in (part for strip in panel.render_lines(panel.outer_size.region) for part in strip):
                assert segment.style is not None
                color = segment.style.color
                assert color is None or color.triplet is None or len(set(color.triplet)) == 1
        await pilot.press("question_mark")


async def test_a_live_loop_is_drawn(policy: Policy, small_map: StimulationMap, make_app: MakeApp) -> None:
    loop = ControlLoop(make_robot("ant"), policy, small_map, 3)
    observer = SnapshotBuilder(loop)
    facts = DriveFacts(
        "Ant", "small", 3, loop.robot.control_dt, loop.robot.attributes, loop.robot.links, policy.layers
    )
    snapshots = []
    for step in range(24):
        events = {
            4: [DriveEvent(4, "behavior", "push", key="w")],
            12: [DriveEvent(12, "behavior", "twitch", key="t")],
        }
        observer.add_step(loop.advance(events.get(step, [])))
        if step % 2:
            snapshots.append(
                observer.build_snapshot(
                    paused=False, speed=1.0, achieved_speed=1.0, recorded_bytes=0, finished=""
                )
            )
    app, connection = make_app([facts, *snapshots[:9]], small_map)
    async with app.run_test(size=(160, 48)) as pilot:
        await played(pilot, connection)
        behaviors = shown(app.query_one("#behaviors"))
        assert "▌push" in behaviors
        assert "▌twitch" in behaviors
        remaining = snapshots[8].active_behaviors[-1].remaining
        assert remaining is not None
        assert f"{remaining * loop.robot.control_dt:.1f} s" in behaviors
        units = shown(app.query_one("#units"))
        assert all(address in units for address in ("0:3", "1:7", "1:2"))
        assert "step 18" in shown(app.query_one("#status"))


async def test_the_help_is_made_once(make_app: MakeApp) -> None:
    """Textual keeps what widgets that are gone had drawn: a help made anew would cost 0.7 MB a look."""
    app, _ = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("question_mark")
        first = app.screen
        await pilot.press("question_mark", "question_mark")
        assert app.screen is first
        assert len(app.screen_stack) == 2
        app.action_help()
        await pilot.pause()
        assert len(app.screen_stack) == 2
        await pilot.press("question_mark")
        app.set_keymap({"pause": "f5"})
        await pilot.press("question_mark")
        assert app.screen is not first
