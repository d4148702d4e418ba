"""The bar of time: what it shows, and what keys and mouse ask of the drive."""

from __future__ import annotations

from dataclasses import replace

import pytest
from textual.pilot import Pilot

from pdtui.core.outcome import Outcome
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, EpisodeEnd, KeyPress, PastPosition
from pdtui.tui.timeline.timeline_bar import TimelineBar
from tests.tui.conftest import MakeApp
from tests.tui.screens import notice, played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]
SIZES = [(80, 24), (120, 40), (200, 60)]


def in_past(snapshot: DriveSnapshot, present: int) -> DriveSnapshot:
    return replace(snapshot, past=PastPosition(present, 1), paused=True, notice="")


@pytest.mark.parametrize("size", SIZES)
async def test_keys_seek_and_the_past_is_named(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    second = round(1 / facts.dt)
    present = snapshots[24].step
    app, connection = make_app(25)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        bar = app.query_one(TimelineBar)
        assert bar.display == (size[1] >= 36)
        await pilot.press("greater_than_sign", "end")
        assert connection.sought == []  # the present is shown already
        await pilot.press("less_than_sign", "less_than_sign")
        assert connection.sought == [present - second, present - 2 * second]
        here = present - 2 * second
        connection.messages.append(in_past(replace(snapshots[20], step=here), present))
        await played(pilot, connection)
        assert bar.display
        assert "◆" in shown(bar)
        assert f"step {here} of {present}, as it was" in notice(app)
        assert "ctrl+n branch off here" in notice(app) or size[0] < 100
        assert f"⏸ {2 * second} steps ago" in shown(app.query_one("#status"))
        await pilot.press("greater_than_sign", "left", "right", "home", "end")
        sought = connection.sought[2:]
        assert sought == [here + second, here, here + second, 1, present]
        await pilot.press("w")
        assert connection.pressed == ["w"]  # the drive says why it is refused
        connection.messages.append(snapshots[25])
        await played(pilot, connection)
        assert bar.display == (size[1] >= 36)
        await pilot.press("ctrl+n")
        assert connection.branched == 1
        await pilot.press("left")
        assert connection.pressed == ["w", "left"]


async def test_the_mouse_seeks(make_app: MakeApp, drive: Drive) -> None:
    _, snapshots = drive
    present = snapshots[24].step
    app, connection = make_app(25)
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        bar = app.query_one(TimelineBar)
        await pilot.mouse_down(bar, offset=(10 + 50, 0))
        await pilot.hover(bar, offset=(10 + 25, 0))
        await pilot.mouse_up(bar, offset=(10 + 25, 0))
        middle, quarter = connection.sought[0], connection.sought[-1]
        assert abs(middle - present / 2) <= present / 50
        assert abs(quarter - present / 4) <= present / 50
        await pilot.hover(bar, offset=(10 + 75, 0))
        assert connection.sought[-1] == quarter
        await pilot.click(bar, offset=(10 + 99, 0))
        assert connection.sought[-1] == present
        assert len(shown(bar)) == 120


async def test_marks_of_keys_and_endings_are_shown_and_found(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    present = snapshots[24].step
    keyed = replace(
        snapshots[24],
        key_presses=(KeyPress(10, "a", 1), KeyPress(40, "space", -1)),
        ends=(EpisodeEnd(19, Outcome.FELL), EpisodeEnd(60, Outcome.ARRIVED)),
    )
    app, connection = make_app([facts, *snapshots[:24], keyed])
    async with app.run_test(size=(200, 60)) as pilot:
        await played(pilot, connection)
        bar = app.query_one(TimelineBar)
        line = shown(bar)
        assert [sign for sign in line if sign in "a✕␣✓●"] == ["a", "✕", "␣", "✓", "●"]
        await pilot.press("left_curly_bracket", "left_curly_bracket", "left_curly_bracket")
        assert connection.sought == [61, 40, 20]
        await pilot.press("right_curly_bracket", "left_curly_bracket", "left_curly_bracket")
        assert connection.sought[3:] == [40, 20, 10]
        await pilot.press("end", "right_curly_bracket")
        assert connection.sought[6:] == [present, present]


async def test_a_recording_shows_what_is_to_come(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    watched = replace(
        facts, length=2 * snapshots[24].step, known_keys=(KeyPress(snapshots[24].step + 20, "w", 0),)
    )
    app, connection = make_app([watched, *snapshots[:25]], watching=True)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        line = shown(app.query_one(TimelineBar))
        assert 35 <= line.index("●") <= 45
        assert line.index("w") > line.index("●")
        assert "─" in line[line.index("●") :]
        await pilot.press("right", "end")
        assert connection.sought == [snapshots[24].step + round(1 / facts.dt), 2 * snapshots[24].step]
        assert connection.pressed == []


async def test_a_branch_forgets_what_came_after(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    app, connection = make_app(25)

    async def table(pilot: Pilot[str]) -> str:
        await played(pilot, connection)
        return shown(app.query_one("#attributes"))

    async with app.run_test(size=(120, 40)) as pilot:
        before = await table(pilot)
        connection.messages += [replace(facts, branches=1), *snapshots[:10]]
        after = await table(pilot)
        assert after != before
        assert shown(app.query_one(TimelineBar)).rstrip().endswith(f"{snapshots[9].step * facts.dt:.1f}")
    fresh, connection = make_app(10)
    async with fresh.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        assert shown(fresh.query_one("#attributes")) == after


async def test_plots_end_at_the_moment_that_is_shown(make_app: MakeApp, drive: Drive) -> None:
    _, snapshots = drive
    app, connection = make_app(25)
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        connection.messages.append(in_past(replace(snapshots[14], history=snapshots[14].history[:0]), 0))
        await played(pilot, connection)
        past = shown(app.query_one("#attributes")).splitlines()
    other, connection = make_app(15)
    async with other.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        then = shown(other.query_one("#attributes")).splitlines()
    # Scales reach as far as all that was seen, so only the last line, the axis, is surely the same.
    assert past[-2] == then[-2]
    assert past[1].split()[:3] == then[1].split()[:3]


async def test_a_pressed_key_is_echoed_before_the_drive_answers(make_app: MakeApp, drive: Drive) -> None:
    _, snapshots = drive
    app, connection = make_app(3)
    async with app.run_test(size=(80, 24)) as pilot:
        await played(pilot, connection)
        behaviors = app.query_one("#behaviors")
        assert "pressed" not in shown(behaviors)
        await pilot.press("w")
        assert "▌forward" in shown(behaviors)
        assert "pressed" in shown(behaviors)
        latched = next(
            one for one in snapshots if any(view.name == "forward" for view in one.active_behaviors)
        )
        connection.messages.append(replace(latched, notice=""))
        await played(pilot, connection)
        assert "pressed" not in shown(behaviors)
        assert "latched" in shown(behaviors)
        await pilot.press("c")
        assert "pressed" in shown(behaviors)
        connection.messages.append(replace(latched, notice="no behavior has key 'c'"))
        await played(pilot, connection)
        assert "pressed" not in shown(behaviors)
