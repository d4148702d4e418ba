"""Whatever ends a drive, its recording is whole and somebody says so."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from multiprocessing import Pipe
from pathlib import Path

import pytest

from pdtui.core.errors import PdtuiError
from pdtui.driving import drive_process, drive_server
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import ENDING_SIGNALS, catch_ending_signals
from pdtui.driving.loop_builder import build_control_loop
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.test_terminal import PATIENCE


@pytest.mark.parametrize("number", ENDING_SIGNALS)
def test_a_signal_ends_a_drive_without_a_screen_between_two_steps(
    number: signal.Signals, map_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "a.rrd"
    command = ["-m", "pdtui", "drive", "ant", "--map", map_path, "--headless", "--steps", 10**8]
    with subprocess.Popen(
        [sys.executable, *map(str, command), "--record", str(path)], stderr=subprocess.PIPE, text=True
    ) as process:
        deadline = time.monotonic() + PATIENCE
        while not (path.exists() and path.stat().st_size > 200_000) and time.monotonic() < deadline:
            time.sleep(0.05)
        process.send_signal(number)
        _, said = process.communicate(timeout=PATIENCE)
    there = examine_session(path)
    assert process.returncode == 1
    assert said == f"pdtui: ended by {number.name}: {there.steps} steps, recorded in {path}\n"
    assert there.whole
    assert there.steps > 100


def test_signals_are_given_back() -> None:
    before = [signal.getsignal(number) for number in ENDING_SIGNALS]
    with catch_ending_signals() as ended:
        assert ended() == ""
        os.kill(os.getpid(), signal.SIGTERM)
        assert ended() == "ended by SIGTERM"
    assert [signal.getsignal(number) for number in ENDING_SIGNALS] == before


def test_an_exception_in_the_simulation_is_told_and_recorded(
    small_map: StimulationMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A world may raise anything; the screen is told what, where, and where the recording is."""

    def broken(config: DriveConfig) -> ControlLoop:
        loop = build_control_loop(config)
        step = loop.robot.step

        def fails(action: object) -> object:
            if loop.step == 7:
                raise ZeroDivisionError("the wheel came off")
            return step(action)  # type: ignore[arg-type]

        monkeypatch.setattr(loop.robot, "step", fails)
        return loop

    monkeypatch.setattr(drive_server, "build_control_loop", broken)
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # they are this process's own
    path = tmp_path / "a.rrd"
    ours, theirs = Pipe()
    drive_process.serve_drive(theirs, DriveConfig("ant", small_map, 0, recording=str(path)))
    messages = []
    while ours.poll():
        messages.append(ours.recv())
    said = str(messages[-1])
    assert isinstance(messages[-1], PdtuiError)
    where = "(test_drive_endings.py, "
    assert said.startswith(f"the simulation failed: ZeroDivisionError: the wheel came off {where}")
    assert said.endswith(f"7 steps, recorded in {path}")
    assert examine_session(path).whole
    assert "the wheel came off" in read_session(path).outcome
