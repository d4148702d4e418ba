"""Drives whose behaviors do more than overwrite units by constants: recorded, replayed and rewound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdtui.api import drive, replay
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.map_reader import parse_map

FURTHER = """
[[behaviors]]
name = "spin"
key = "a"
together = ["nudge"]
[[behaviors.interventions]]
kind = "imprint"
units = ["0:*"]
rates = {"heading offset" = -0.8}
[[behaviors]]
name = "nudge"
key = "k"
onset = {signal = "vy", crosses = "up", level = 0.0, delay = 0.2}
[[behaviors.interventions]]
kind = "add"
values = {"1:3" = 1.0, "1:4" = -1.0}
time_gate = {times = [0.0, 0.2], factors = [1.0, 0.0], repeat = 0.4}
[[behaviors]]
name = "whirl"
key = "l"
fade = 0.6
[[behaviors.interventions]]
kind = "imprint"
units = ["0:*"]
rates = {"heading offset" = -12.0}
[[behaviors]]
name = "face"
key = "f"
mode = "pid"
pid = {attribute = "yaw", kp = 0.4, ki = 0.25, kd = 0.0, limit = 100.0, step = 0.5}
[[behaviors.interventions]]
kind = "imprint"
units = ["0:1", "0:2"]
values = {"heading offset" = -1.0}
"""


@pytest.fixture
def further_map(map_text: str, tmp_path: Path) -> Path:
    path = tmp_path / "further.toml"
    path.write_text(map_text + FURTHER)
    return path


def test_a_session_with_interventions_replays_bit_for_bit(further_map: Path, tmp_path: Path) -> None:
    keys = {5: "a", 15: "k", 60: "backspace", 70: "f", 75: "left", 100: "k"}
    session = tmp_path / "drive.rrd"
    driven = drive("ant", further_map, keys=keys, steps=140, seed=3, record=session)
    assert replay(session).identical
    recorded = read_session(session)
    assert recorded.stimulations == driven.stimulations
    waits = [one.waiting for active in recorded.active for one in active if one.name == "nudge"]
    assert None in waits
    assert any(wait is not None for wait in waits)
    touched = {len(stimulation.units) for stimulation in driven.stimulations}
    assert {0, 2, 16, 18} <= touched


def test_a_rewind_returns_gait_and_imprint(policy: Policy, map_text: str) -> None:
    def drive_on(rewinds: bool) -> list[int]:
        loop = ControlLoop(make_robot("ant"), policy, parse_map(map_text + FURTHER, "m"), 3)
        press = {8: "spin", 22: "nudge"}
        digests = []
        for step in range(30):
            events = [DriveEvent(step, "behavior", press[step])] if step in press else []
            digests.append(loop.advance(events).digest)
        if rewinds:
            digests = digests[:20]
            back = loop.advance([DriveEvent(30, "rewind", value=20.0)])
            digests.append(back.digest)
            for step in range(31, 40):
                events = [DriveEvent(step, "behavior", "nudge")] if step == 32 else []
                digests.append(loop.advance(events).digest)
        return digests

    straight, rewound = drive_on(rewinds=False), drive_on(rewinds=True)
    assert rewound == straight


def test_the_session_holds_what_an_imprint_came_to(further_map: Path) -> None:
    driven = drive("ant", further_map, keys={5: "a"}, steps=20, seed=3)
    stimulation = driven.stimulations[12]
    values = driven.activations[12, list(stimulation.units)]
    np.testing.assert_array_equal(np.array(stimulation.values, np.float32), values)


def test_a_fade_after_more_than_a_turn_replays_and_rewinds(further_map: Path, tmp_path: Path) -> None:
    session = tmp_path / "drive.rrd"
    keys = {5: "l", 15: "space", 80: "backspace"}  # back by 3 s, into the fade
    driven = drive("ant", further_map, keys=keys, steps=100, seed=3, record=session)
    acts = [bool(stimulation.units) for stimulation in driven.stimulations]
    assert acts[5:28] == [True] * 22 + [False]  # 10 steps held, and 12 while it fades
    assert acts[80:88] == acts[20:28]
    assert replay(session).identical


def test_a_rewind_into_a_fade_goes_on_fading(policy: Policy, map_text: str) -> None:
    def drive_on(rewinds: bool) -> list[int]:
        loop = ControlLoop(make_robot("ant"), policy, parse_map(map_text + FURTHER, "m"), 3)
        events = {5: DriveEvent(5, "behavior", "whirl"), 16: DriveEvent(16, "default")}
        digests = [loop.advance([events[step]] if step in events else []).digest for step in range(26)]
        if rewinds:  # to step 20, in the middle of the fade
            back = loop.advance([DriveEvent(26, "rewind", value=20.0)])
            digests = [*digests[:20], back.digest, *(loop.advance().digest for _ in range(5))]
        return digests

    assert drive_on(rewinds=True) == drive_on(rewinds=False)
