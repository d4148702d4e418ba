"""The operator takes over components of the action: what acts, what is recorded, and what repeats it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.csv
import pytest
from click.testing import CliRunner

import pdtui
from pdtui.cli import main
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError, RobotError
from pdtui.core.robot_links_and_state import ManualControl
from pdtui.core.step_record import ReplacedAction, StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_arrays import DriveArrays
from pdtui.driving.headless_drive import drive_headless
from pdtui.driving.keystrokes import format_keystrokes, interpret_keys, read_keystrokes
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.robots import make_robot
from pdtui.sessions.export.export_writer import export_stream
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.session_summary import read_session_summary, summarize_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.turning_robot import Vehicle, turning_loop

STEERING = ManualControl("steering", 0, "sideways", step=0.25, return_rate=5.0, scale=2.0)
THROTTLE = ManualControl("throttle", 1, "lengthways", step=0.25)
KEYS: dict[int, str | list[str]] = {
    10: "t",
    20: ["enter", "left", "up"],
    25: "up",
    40: "enter",
    60: ["enter", "right"],
    200: "backspace",
    220: "space",
    230: "r",
}
"""A takeover that is handed back, one whose middle is rewound to (step 50 back from 200), and a reset."""


class SteeredVehicle(Vehicle):
    """A vehicle whose turning and pace an operator can take over."""

    manual_controls: tuple[ManualControl, ...] = (STEERING, THROTTLE)


@pytest.fixture
def loop() -> ControlLoop:
    turning = turning_loop()
    return ControlLoop(SteeredVehicle(), turning.policy, turning.map, 0)


def _press(loop: ControlLoop, *keys: str) -> StepRecord:
    events = interpret_keys(keys, loop)
    return loop.advance([event for event in events if isinstance(event, DriveEvent)])


def _control(step: int, name: str, value: float) -> DriveEvent:
    return DriveEvent(step, "control", name, value)


def _drive(path: Path) -> DriveArrays:
    turning = turning_loop()
    stimulation_map = replace(turning.map, policy_hash=turning.policy.sha256)
    return pdtui.drive(
        SteeredVehicle(), stimulation_map, policy=turning.policy, keys=KEYS, steps=260, record=path
    )


def test_the_operators_action_acts_and_the_policys_is_recorded(loop: ControlLoop) -> None:
    loop.advance([DriveEvent(0, "behavior", "turn")])
    policy_alone = loop.advance()
    assert policy_alone.replaced == ()
    record = loop.advance([_control(2, "steering", -0.5)])
    assert record.action.tolist() == [-1.0, policy_alone.action[1]]
    assert record.action.dtype == policy_alone.action.dtype
    assert record.replaced == (ReplacedAction(0, float(policy_alone.action[0])),)
    # The policy runs on, with its behavior.
    np.testing.assert_array_equal(record.activations, policy_alone.activations)
    assert record.stimulation == policy_alone.stimulation
    both = loop.advance([DriveEvent(3, "takeover"), _control(3, "throttle", 0.75)])
    assert [one.component for one in both.replaced] == [0, 1]
    assert both.action[1] == 0.75
    back = loop.advance([DriveEvent(4, "hand back")])
    assert back.replaced == ()
    np.testing.assert_array_equal(back.action, policy_alone.action)
    assert [one.name for one in back.behaviors] == ["turn"]


def test_only_the_world_differs_from_one_that_was_given_the_same_actions(loop: ControlLoop) -> None:
    robot = SteeredVehicle()
    robot.reset(seed=0)
    for step in range(30):
        record = loop.advance([_control(step, "steering", 0.5), _control(step, "throttle", -0.25)])
        robot.step(np.array([1.0, -0.25], np.float32))
        assert record.digest == robot.digest()


def test_a_control_that_returns_goes_back_to_0_and_another_stays(loop: ControlLoop) -> None:
    loop.advance([_control(0, "steering", -0.25), _control(0, "throttle", 0.5)])
    actions = np.array([loop.advance().action for _ in range(4)])
    # 5 per second is 0.1 in a step of 0.02 s; the action is twice the steering.
    np.testing.assert_allclose(actions[:, 0], [-0.3, -0.1, 0.0, 0.0], atol=1e-7)
    assert actions[:, 1].tolist() == [0.5] * 4


def test_keys_take_over_steer_and_hand_back(loop: ControlLoop) -> None:
    assert interpret_keys(["left"], loop) == ["no target is held; only behaviors of mode pid hold one"]
    record = _press(loop, "enter", "left", "left", "up", "down", "down")
    assert [(event.kind, event.name, event.value, event.key) for event in record.events] == [
        ("takeover", "", 0.0, "enter"),
        ("control", "steering", 0.25, "left"),
        ("control", "steering", 0.5, "left"),
        ("control", "throttle", 0.25, "up"),
        ("control", "throttle", 0.0, "down"),
        ("control", "throttle", -0.25, "down"),
    ]
    assert record.action.tolist() == [1.0, -0.25]
    for _ in range(12):
        record = _press(loop, "right", "down")
    assert record.action.tolist() == [-2.0, -1.0]
    assert _press(loop, "enter").events == (DriveEvent(13, "hand back", key="enter"),)
    assert loop.takeover.values == {}


def test_arrows_still_move_a_target_unless_a_control_of_theirs_is_taken_over(loop: ControlLoop) -> None:
    _press(loop, "h")
    loop.advance([_control(1, "throttle", 0.0)])
    (left,) = _press(loop, "left").events
    (up,) = _press(loop, "up").events
    assert (left.kind, left.name) == ("target", "hold heading")
    assert (up.kind, up.name) == ("control", "throttle")


@pytest.mark.parametrize("key", ["space", "r"])
def test_default_and_reset_end_a_takeover(loop: ControlLoop, key: str) -> None:
    _press(loop, "t", "enter", "left")
    assert interpret_keys([key, "left"], loop)[1] == "no target is held; only behaviors of mode pid hold one"
    assert loop.takeover.values
    record = _press(loop, key)
    assert (record.replaced, record.behaviors) == ((), ())


def test_an_episode_that_ends_hands_back(loop: ControlLoop) -> None:
    record = loop.advance([_control(0, "steering", 1.0), DriveEvent(0, "behavior", "turn")])
    loop.robot.state[1] = 9.0  # type: ignore[attr-defined]
    assert loop.advance().ended == "tipped over"
    assert interpret_keys(["enter"], loop) == [DriveEvent(2, "takeover", key="enter")]
    record = loop.advance()
    assert (record.episode, record.replaced) == (1, ())


def test_a_rewind_returns_to_the_takeover_of_then(loop: ControlLoop) -> None:
    loop.advance([DriveEvent(0, "takeover"), _control(0, "throttle", 0.5)])
    first = [loop.advance() for _ in range(29)]
    loop.advance([DriveEvent(30, "hand back")])
    events = interpret_keys(["enter", "up"], loop)
    assert events[0] == DriveEvent(31, "takeover", key="enter")
    again = [loop.advance([DriveEvent(31, "rewind", value=10.0)]), *(loop.advance() for _ in range(19))]
    assert [one.digest for one in again] == [one.digest for one in first[9:]]
    assert loop.takeover.values == {"steering": 0.0, "throttle": 0.5}


def test_a_takeover_is_recorded_and_repeats_with_its_rewind(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    driven = _drive(path)
    back = next(event for event in driven.events if event.kind == "rewind")
    assert back.value == 50.0
    session = read_session(path)
    assert session.events == driven.events
    assert session.replaced_actions == driven.replaced_actions
    np.testing.assert_array_equal(session.actions, driven.actions)
    taken = [bool(replaced) for replaced in session.replaced_actions]
    # Step 200 goes on where step 50 was: before the second takeover.
    assert [step for step, on in enumerate(taken) if on] == [*range(20, 40), *range(60, 200)]
    result = pdtui.replay(path, robot=SteeredVehicle(), policy=turning_loop().policy)
    assert result.verdict == "identical: 260 steps"
    assert summarize_session(read_session_header(path)) == read_session_summary(read_session_header(path))


def test_a_rewind_into_a_takeover_repeats(loop: ControlLoop, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    presses = {0: ["enter", "left", "up"], 45: ["enter"], 50: ["t"], 175: ["backspace"]}
    loop.map = replace(loop.map, policy_hash=loop.policy.sha256)
    drive_headless(loop, presses, 200, SessionRecorder(path, loop.info))
    session = read_session(path)
    assert session.events[-1] == DriveEvent(175, "rewind", value=20.0, key="backspace")
    taken = [step for step, replaced in enumerate(session.replaced_actions) if replaced]
    assert taken == [*range(45), *range(175, 200)]
    assert pdtui.replay(path, robot=SteeredVehicle(), policy=loop.policy).identical


def test_a_recorded_policys_action_that_was_changed_is_named(loop: ControlLoop, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    with SessionRecorder(path, loop.info) as recorder:
        for step in range(10):
            record = loop.advance([DriveEvent(3, "takeover")] if step == 3 else [])
            if step == 5:
                record = record._replace(replaced=(record.replaced[0], ReplacedAction(1, 0.5)))
            recorder.write(record)
    result = pdtui.replay(path, robot=SteeredVehicle(), policy=loop.policy)
    assert result.verdict.startswith("differs: step 5 of 10: policy's action 1 is 0.0, recorded 0.5")


def test_a_step_of_takeover_is_one_step_of_involvement_everywhere(loop: ControlLoop, tmp_path: Path) -> None:
    """Keys before steps 5, 10 and 30; taken over in 10 to 29; the key of step 10 does not count twice."""
    path, presses = tmp_path / "a.rrd", {5: ["t"], 10: ["enter", "up"], 30: ["enter"]}
    builder, records = SnapshotBuilder(loop), []
    with SessionRecorder(path, loop.info) as recorder:
        for step in range(40):
            records.append(_press(loop, *presses.get(step, ())))
            builder.add_step(records[-1])
            recorder.write(records[-1])
    assert [one.step for one in records if one.involved] == [5, *range(10, 31)]
    snapshot = builder.build_snapshot(paused=False, speed=1, achieved_speed=1, recorded_bytes=0, finished="")
    header = read_session_header(path)
    for summary in (read_session_summary(header), summarize_session(header)):
        assert (summary.involvement, summary.taken_over) == (22, 20)
        assert [tally.involvement for tally in summary.tallies] == [22]
    assert snapshot.involvement == snapshot.statistics.involvement == 22
    fresh = ControlLoop(SteeredVehicle(), loop.policy, loop.map, 0)
    assert drive_headless(fresh, presses, 40, None).involvement == 22


def test_the_session_says_it_in_words_and_as_a_table(tmp_path: Path) -> None:
    path, table = tmp_path / "a.rrd", tmp_path / "takeover.csv"
    driven = _drive(path)
    shown = CliRunner().invoke(main, ["sessions", "show", str(path)])
    assert shown.exit_code == 0, shown.output
    said = [" ".join(line.split()) for line in shown.output.splitlines()]
    for line in (
        "human involvement 165 steps with a key press or a takeover (63.5 %)",
        "taken over 160 steps",
        "0.40 s 20 enter the operator took over",
        "0.40 s 20 left steering set to 0.25 by the operator",
        "0.80 s 40 enter handed back to the policy",
    ):
        assert line in said, shown.output
    assert export_stream(path, "takeover", table) == 320
    rows = pyarrow.csv.read_csv(table).to_pydict()
    assert (rows["step"][:2], rows["action"][:2]) == ([20, 20], [0, 1])
    np.testing.assert_allclose(rows["operator"][:2], [0.5, 0.25])
    np.testing.assert_allclose(rows["policy"][:2], [one.natural for one in driven.replaced_actions[20]])


def test_a_keystroke_file_takes_over(loop: ControlLoop, tmp_path: Path) -> None:
    path = tmp_path / "keys.txt"
    path.write_text("3 enter\n3 left\n9 down\n12 enter\n")
    presses = read_keystrokes(path, loop.map)
    assert presses == {3: ["enter", "left"], 9: ["down"], 12: ["enter"]}
    events = [event for step in range(15) for event in _press(loop, *presses.get(step, ())).events]
    assert format_keystrokes(events) == path.read_text()


def test_a_robot_without_manual_controls_refuses() -> None:
    loop = ControlLoop(
        make_robot("ant"), pdtui.load_policy("ant"), replace(turning_loop().map, behaviors={}), 0
    )
    why = "ant has no controls that an operator can take over"
    assert interpret_keys(["enter"], loop) == [why]
    for event in (DriveEvent(0, "takeover"), _control(0, "steering", 0.5), DriveEvent(0, "hand back")):
        with pytest.raises(KeystrokeError, match=f"step 0: {why}"):
            loop.advance([event])
    with pytest.raises(KeystrokeError, match=f"step 2: key 'enter': {why}"):
        pdtui.drive("ant", keys={2: "enter"}, steps=3)


@pytest.mark.parametrize(
    ("event", "message"),
    [
        (_control(0, "brake", 1.0), "vehicle has no manual control 'brake'; available: steering, throttle"),
        (_control(0, "steering", 1.5), "steering: expected a value from −1 to 1, found 1.5"),
        (_control(0, "throttle", float("nan")), "throttle: expected a value from −1 to 1, found nan"),
        (DriveEvent(0, "hand back"), "no control is taken over that could be handed back"),
    ],
)
def test_an_event_that_does_not_fit_is_named(loop: ControlLoop, event: DriveEvent, message: str) -> None:
    with pytest.raises(KeystrokeError, match=f"step 0: {message}"):
        loop.advance([event])


@pytest.mark.parametrize(
    ("controls", "message"),
    [
        (
            (replace(THROTTLE, action=2),),
            "vehicle: control 'throttle' moves component 2 of the action, .* has 2",
        ),
        ((STEERING, replace(THROTTLE, action=0)), "'steering' and 'throttle' both move component 0"),
    ],
)
def test_controls_that_do_not_fit_the_action_are_named(
    controls: tuple[ManualControl, ...], message: str
) -> None:
    turning, robot = turning_loop(), SteeredVehicle()
    robot.manual_controls = controls
    with pytest.raises(RobotError, match=message):
        ControlLoop(robot, turning.policy, turning.map, 0)
