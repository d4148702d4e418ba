"""Drives with edits: held units, the stack of behaviors, gains; they are events, and repeat bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdtui.core.drive_events import DriveEvent, describe_event
from pdtui.core.errors import KeystrokeError
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import drive_headless, events_of_pressed_keys
from pdtui.driving.keystrokes import format_keystrokes, interpret_keys, note_press, read_keystrokes
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.stack.stack_entry import find_conflicts
from pdtui.stimulation.stimulation_map import StimulationMap

KEYS = """\
5 unit 0:3 1.25
5 unit 1:2 -3.5  # outside what a tanh puts out
9 w
12 beside twitch
12 mute push
15 unmute push
15 order twitch 0
16 factor push 0.5
18 free 0:3
20 beside hold heading
22 kp hold heading 4
22 limit hold heading 0.25
22 target hold heading 0.3
26 release hold heading
30 space
"""


@pytest.fixture
def loop(policy: Policy, small_map: StimulationMap) -> ControlLoop:
    return ControlLoop(make_robot("ant"), policy, small_map, 3)


def advance(loop: ControlLoop, *pressed: str) -> StepRecord:
    return loop.advance(events_of_pressed_keys(pressed, loop))


def outputs(record: StepRecord) -> dict[int, float]:
    return dict(zip(record.stimulation.units, record.stimulation.values, strict=True))


def test_a_held_unit_puts_out_its_value_until_it_is_let_go(loop: ControlLoop) -> None:
    plain = advance(loop)
    held = advance(loop, "unit 0:3 1.25", "unit 1:2 -3.5")
    assert outputs(held) == {3: 1.25, 18: -3.5}
    assert (held.activations[3], held.activations[18]) == (1.25, -3.5)
    assert abs(held.natural[0]) < 1.0
    assert held.involved
    assert not plain.stimulation
    assert outputs(advance(loop, "free 0:3")) == {18: -3.5}
    assert not advance(loop, "space").stimulation


def test_a_held_unit_comes_after_every_behavior(loop: ControlLoop) -> None:
    advance(loop, "w")
    assert outputs(advance(loop, "unit 1:7 0.5"))[23] == 0.5
    assert outputs(advance(loop, "w"))[23] == 0.5
    assert outputs(advance(loop, "free 1:7"))[23] == 2.0


def test_behaviors_are_stacked_muted_and_moved(loop: ControlLoop) -> None:
    advance(loop, "w")
    record = advance(loop, "beside hold heading")
    assert [one.name for one in record.behaviors] == ["push", "hold heading"]
    assert [layer.name for layer in loop.latch.stack] == ["push", "hold heading"]
    record = advance(loop, "mute push", "order push 9")
    assert [one.name for one in record.behaviors] == ["hold heading"]
    assert set(outputs(record)) == {5}
    assert [(layer.name, layer.muted) for layer in loop.latch.stack] == [
        ("hold heading", False),
        ("push", True),
    ]
    record = advance(loop, "unmute push", "release hold heading")
    assert set(outputs(record)) == {3, 23}


def test_the_last_of_the_stack_decides_on_a_unit_that_two_change(loop: ControlLoop) -> None:
    advance(loop, "w", "beside hold heading", "unit 0:5 0.25")
    stack, held = loop.latch.stack, list(loop.latch.held.outputs)
    assert find_conflicts(stack) == frozenset()
    assert find_conflicts(stack, held) == {5}
    advance(loop, "mute hold heading")
    assert find_conflicts(loop.latch.stack, held) == frozenset()


def test_a_gain_acts_from_the_next_control_step_on(loop: ControlLoop) -> None:
    advance(loop, "h", "target hold heading 0.2")
    before = advance(loop).behaviors[0]
    advance(loop, "kp hold heading 0", "ki hold heading 0", "kd hold heading 0")
    after = [advance(loop).behaviors[0].magnitude for _ in range(3)]
    assert abs(before.magnitude or 0.0) > 0.1
    assert len(set(after)) == 1, "what the integral has summed up stays"
    assert loop.map.behaviors["hold heading"].pid is not None
    assert loop.map.behaviors["hold heading"].pid.kp == 2.0, "the map stays as it is"


def test_a_limit_bounds_the_magnitude_from_the_next_control_step_on(loop: ControlLoop) -> None:
    advance(loop, "h", "target hold heading -0.5")
    assert abs(advance(loop).behaviors[0].magnitude or 0.0) > 0.5
    after = advance(loop, "limit hold heading 0.5")
    assert abs(after.behaviors[0].magnitude or 0.0) == 0.5
    with pytest.raises(KeystrokeError, match="limit: expected more than 0, found -1"):
        events_of_pressed_keys(["limit hold heading -1"], loop)


@pytest.mark.parametrize(
    ("pressed", "message"),
    [
        ("unit 2:0 1.0", "unit 2:0 does not exist"),
        ("unit x 1.0", "expected layer:index"),
        ("free 0:3", "unit 0:3 is not held"),
        ("mute push", "behavior 'push' is not latched"),
        ("beside dance", "no behavior 'dance'; available: push, twitch"),
        ("kp twitch 1.0", "behavior 'twitch' is not latched"),
        ("wave push", "no edit 'wave'"),
    ],
)
def test_an_edit_of_what_is_not_there_is_refused(loop: ControlLoop, pressed: str, message: str) -> None:
    with pytest.raises(KeystrokeError, match=message):
        events_of_pressed_keys([pressed], loop)
    first, second = interpret_keys([pressed, "unit 0:1 0.5"], loop)
    assert isinstance(first, str)
    assert isinstance(second, DriveEvent), "the next edit is none the worse"


def test_a_rewind_and_a_reset_bring_back_or_let_go_of_held_units(loop: ControlLoop) -> None:
    for pressed in ([], ["unit 0:3 1.25"], *[[]] * 20):
        advance(loop, *pressed)
    loop.advance([DriveEvent(loop.step, "rewind", value=0.0)])
    assert not loop.latch.held.outputs
    loop.advance([DriveEvent(loop.step, "rewind", value=10.0)])
    assert loop.latch.held.outputs == {3: 1.25}
    advance(loop, "r")
    assert not loop.latch.is_acting


def test_many_edits_of_one_thing_before_a_step_are_one() -> None:
    pressed: list[str] = []
    for key in ("unit 0:3 0.1", "unit 0:3 0.2", "unit 0:4 0.2", "unit 0:3 0.3", "w", "w"):
        note_press(pressed, key)
    assert pressed == ["unit 0:3 0.2", "unit 0:4 0.2", "unit 0:3 0.3", "w", "w"]


def test_keystrokes_with_edits_are_recorded_replayed_and_written_again(
    tmp_path: Path, small_map: StimulationMap
) -> None:
    keys, session = tmp_path / "keys.txt", tmp_path / "edits.rrd"
    keys.write_text(KEYS)
    presses = read_keystrokes(keys, small_map)
    config = DriveConfig("ant", small_map, seed=4)
    loop = build_control_loop(config)
    drive_headless(loop, presses, 40, SessionRecorder(session, loop.info))
    assert replay_session(session).identical
    read = read_session(session)
    said = [describe_event(event) for event in read.events]
    assert said[:2] == ["unit 0:3 held at 1.25", "unit 1:2 held at -3.5"]
    assert "gain kp of 'hold heading' set to 4" in said
    again = tmp_path / "again.txt"
    again.write_text(format_keystrokes(read.events))
    assert read_keystrokes(again, small_map) == presses
    repeated = build_control_loop(config)
    digests = [
        repeated.advance(events_of_pressed_keys(presses.get(step, ()), repeated)).digest for step in range(40)
    ]
    np.testing.assert_array_equal(digests, read.digests)
