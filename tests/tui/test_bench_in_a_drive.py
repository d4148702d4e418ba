"""The unit bench on the screen of a real drive, in its own process: what it edits replays bit for bit."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from textual.pilot import Pilot

from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.keystrokes import format_keystrokes
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.drive_app import DriveApp
from tests.tui.screens import shown

PATIENCE = 60.0


async def until(pilot: Pilot[str], wanted: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not wanted():
        assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {what}"
        await pilot.pause(0.02)


async def test_edits_on_the_screen_are_felt_recorded_and_replayed(
    small_map: StimulationMap, tmp_path: Path
) -> None:
    session = tmp_path / "bench.rrd"
    connection = DriveClient(DriveConfig("ant", small_map, seed=3, recording=str(session)))
    app = DriveApp(connection, small_map, fps=30)

    def held() -> dict[int, float]:
        return {} if app.snapshot is None else dict(app.snapshot.held_units)

    def stack() -> list[tuple[str, bool]]:
        return [] if app.snapshot is None else [(one.name, one.muted) for one in app.snapshot.stack]

    try:
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: app.snapshot is not None and app.snapshot.step > 0, "the first step")
            # Paused, an edit acts at once, and the robot cannot fall before the last one.
            await pilot.press("p")
            await until(pilot, lambda: app.snapshot is not None and app.snapshot.paused, "the pause")
            await pilot.press("ctrl+e", "right", "right", "right", "enter", "equals_sign", *"1.25", "enter")
            await until(pilot, lambda: held() == {3: 1.25}, "the unit")
            await pilot.press("n")
            await until(
                pilot,
                lambda: (
                    app.snapshot is not None
                    and [(one.unit, one.overwritten) for one in app.snapshot.stimulated_units] == [(3, 1.25)]
                ),
                "a control step with it",
            )
            await pilot.press("w")
            await until(pilot, lambda: stack() == [("push", False)], "the behavior")
            await pilot.press("tab", "enter")
            await until(pilot, lambda: stack() == [("push", True)], "the mute")
            assert "muted" in shown(app.query_one("#bench-layers"))
            await pilot.press("down", "enter")
            await until(pilot, lambda: stack() == [("push", True), ("twitch", False)], "the second layer")
            await pilot.press("space")
            await until(pilot, lambda: not held() and not stack(), "the default key")
            before = 0 if app.snapshot is None else app.snapshot.step
            await pilot.press("n")  # what was pressed belongs to this control step
            await until(pilot, lambda: app.snapshot is not None and app.snapshot.step > before, "a step")
    finally:
        connection.close()
    replay = replay_session(session)
    assert replay.identical
    told = format_keystrokes(read_session(session).events)
    assert [line.split(" ", 1)[1] for line in told.splitlines()] == [
        "unit 0:3 1.25",
        "w",
        "mute push",
        "beside twitch",
        "space",
    ]
