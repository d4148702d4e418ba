"""Keys become events; keystroke files say what is wrong in which line."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.keystrokes import (
    format_keystrokes,
    interpret_key,
    interpret_keys,
    list_drive_keys,
    read_keystrokes,
)
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import StimulationMap


@pytest.fixture
def loop(policy: Policy, small_map: StimulationMap) -> ControlLoop:
    return ControlLoop(make_robot("ant"), policy, small_map, 3)


def _press(loop: ControlLoop, key: str) -> DriveEvent | str:
    event = interpret_key(key, loop)
    loop.advance([event] if isinstance(event, DriveEvent) else [])
    return event


def test_keys_mean_what_the_map_and_the_state_say(loop: ControlLoop) -> None:
    assert _press(loop, "w") == DriveEvent(0, "behavior", "push", key="w")
    assert _press(loop, "plus") == DriveEvent(1, "factor", "push", 1.25, "plus")
    assert _press(loop, "space") == DriveEvent(2, "default", key="space")
    assert _press(loop, "plus") == "no behavior is latched, so there is no strength to change"
    assert _press(loop, "left") == "no target is held; only behaviors of mode pid hold one"
    assert _press(loop, "z") == "no behavior has key 'z'"
    assert _press(loop, "h") == DriveEvent(6, "behavior", "hold heading", key="h")
    target = loop.latch.active[0].target
    assert target is not None
    left, right = _press(loop, "left"), _press(loop, "right")
    assert isinstance(left, DriveEvent)
    assert isinstance(right, DriveEvent)
    assert (left.step, left.kind, left.name, left.key) == (7, "target", "hold heading", "left")
    assert (left.value, right.value) == pytest.approx((target + 0.1, target))
    assert _press(loop, "backspace") == "nothing to rewind to yet"
    while loop.step < 75:
        loop.advance()
    assert _press(loop, "backspace") == DriveEvent(75, "rewind", value=10.0, key="backspace")
    assert _press(loop, "r") == DriveEvent(76, "reset", key="r")


def test_keys_of_one_step_mean_something_after_each_other(loop: ControlLoop) -> None:
    before = loop.latch.active
    strengthened, again, cleared, refused = interpret_keys(["w", "plus", "plus", "space", "plus"], loop)[1:]
    assert (strengthened, again) == (
        DriveEvent(0, "factor", "push", 1.25, "plus"),
        DriveEvent(0, "factor", "push", 1.25**2, "plus"),
    )
    assert cleared == DriveEvent(0, "default", key="space")
    assert refused == "no behavior is latched, so there is no strength to change"
    assert loop.latch.active == before


def test_each_rewind_goes_back_three_more_seconds(loop: ControlLoop) -> None:
    while loop.step < 205:
        loop.advance()
    both = interpret_keys(["backspace", "backspace"], loop)
    assert both == [
        DriveEvent(205, "rewind", value=140.0, key="backspace"),
        DriveEvent(205, "rewind", value=80.0, key="backspace"),
    ]
    first, second = _press(loop, "backspace"), _press(loop, "backspace")
    assert (first, second) == (both[0], DriveEvent(206, "rewind", value=80.0, key="backspace"))
    while loop.step < 225:
        loop.advance()
    # 80 + 18 steps have led here: 60 of them back is step 38, and step 30 is the state kept before it.
    assert _press(loop, "backspace") == DriveEvent(225, "rewind", value=30.0, key="backspace")
    assert _press(loop, "backspace") == "nothing to rewind to yet"


def test_a_rewind_goes_back_along_the_way_that_led_here(loop: ControlLoop) -> None:
    """Steps that were rewound are no longer behind the robot."""
    while loop.step < 100:
        loop.advance()
    assert _press(loop, "backspace") == DriveEvent(100, "rewind", value=40.0, key="backspace")
    while loop.step < 180:
        loop.advance()
    # Steps 0 to 40 and 100 to 180 have led here.
    assert _press(loop, "backspace") == DriveEvent(180, "rewind", value=120.0, key="backspace")
    assert _press(loop, "backspace") == DriveEvent(181, "rewind", value=0.0, key="backspace")


def test_many_keys_a_step_are_never_more_than_refused(loop: ControlLoop, small_map: StimulationMap) -> None:
    drawn = random.Random(5)
    keys = [*list_drive_keys(small_map), "z"]
    kinds = set()
    for _ in range(300):
        pressed = [drawn.choice(keys) for _ in range(drawn.randrange(8))]
        events = [one for one in interpret_keys(pressed, loop) if isinstance(one, DriveEvent)]
        kinds |= {event.kind for event in loop.advance(events).events}
    assert kinds == {"behavior", "default", "target", "factor", "reset", "rewind"}


def test_a_keystroke_file_is_read(tmp_path: Path, small_map: StimulationMap) -> None:
    path = tmp_path / "keys.txt"
    path.write_text("# a drive\n10 w\n10 t  # together\n\n  25 space\n")
    assert read_keystrokes(path, small_map) == {10: ["w", "t"], 25: ["space"]}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("10 w\nten space", r"keys\.txt:2: expected 'STEP KEY', found 'ten space'"),
        ("10", r"keys\.txt:1: expected 'STEP KEY'"),
        ("10 w\n5 t", r"keys\.txt:2: step 5 comes after step 10"),
        ("1 z", r"keys\.txt:1: key 'z' does nothing; keys are space, w, t, h"),
        ("-1 w", r"keys\.txt:1: expected 'STEP KEY'"),
    ],
)
def test_a_bad_line_is_named(tmp_path: Path, small_map: StimulationMap, text: str, message: str) -> None:
    path = tmp_path / "keys.txt"
    path.write_text(text)
    with pytest.raises(KeystrokeError, match=message):
        read_keystrokes(path, small_map)


def test_a_file_that_is_no_text_is_refused(tmp_path: Path, small_map: StimulationMap) -> None:
    path = tmp_path / "keys.txt"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(KeystrokeError, match="cannot be read as keystrokes"):
        read_keystrokes(path, small_map)
    with pytest.raises(KeystrokeError, match="cannot be read as keystrokes"):
        read_keystrokes(tmp_path / "gone.txt", small_map)


def test_events_are_written_as_keystrokes(tmp_path: Path, small_map: StimulationMap) -> None:
    events = (
        DriveEvent(3, "behavior", "push", key="w"),
        DriveEvent(5, "reset"),
        DriveEvent(9, "default", key="space"),
    )
    path = tmp_path / "keys.txt"
    path.write_text(format_keystrokes(events))
    assert read_keystrokes(path, small_map) == {3: ["w"], 9: ["space"]}
