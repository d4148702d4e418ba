"""A screen that is killed takes its simulation along, which first completes the recording."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.core.processes.test_worker_pool import is_alive

PATIENCE = 60.0
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


def show_until(config: DriveConfig, moment: str, told: Connection) -> None:
    """Drive until a moment, tell the simulation's process number, and do nothing more."""
    client = DriveClient(config)
    step = 0
    while moment != "loading" and step < 20:
        message = client.poll_message()
        step = message.step if isinstance(message, DriveSnapshot) else step
        time.sleep(0.01)
    if moment == "paused":
        client.change_pace("pause")
    client.press_key("w")
    told.send(client.pid)
    time.sleep(600)


@pytest.mark.parametrize("moment", ["loading", "driving", "paused"])
def test_the_simulation_ends_with_a_killed_screen(
    small_map: StimulationMap, tmp_path: Path, moment: str
) -> None:
    recording = tmp_path / "drive.rrd"
    config = DriveConfig("ant", small_map, 3, recording=str(recording))
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    screen = context.Process(target=show_until, args=(config, moment, theirs))
    screen.start()
    try:
        assert ours.poll(PATIENCE)
        simulation = ours.recv()
        assert is_alive(simulation)
    finally:
        screen.kill()
        screen.join()
    deadline = time.monotonic() + PATIENCE
    while is_alive(simulation) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not is_alive(simulation)
    if moment == "loading" and not recording.exists():
        return
    assert examine_session(recording).whole
    assert read_session(recording).outcome == "the screen went away"
    if moment != "loading":
        assert replay_session(recording).identical


def test_a_killed_recorder_ends_the_drive_with_one_sentence(
    small_map: StimulationMap, tmp_path: Path
) -> None:
    recording = tmp_path / "drive.rrd"
    client = DriveClient(DriveConfig("ant", small_map, 3, recording=str(recording)))
    deadline = time.monotonic() + PATIENCE
    while not client.recording:
        assert time.monotonic() < deadline
        client.poll_message()
        time.sleep(0.01)
    (recorder,) = find_processes_writing(recording)
    os.kill(recorder, signal.SIGKILL)
    finished = ""
    while not finished and time.monotonic() < deadline:
        message = client.poll_message()
        finished = message.finished if isinstance(message, DriveSnapshot) else ""
        time.sleep(0.01)
    line = f"the recorder's process was killed by SIGKILL; the recording up to then is in {recording}"
    assert finished == line
    assert client.close().startswith(line)
    assert client.failed
    assert read_session(recording).steps >= 1


def find_processes_writing(path: Path) -> list[int]:
    """Return the processes that hold a file open, other than this one."""
    holders = []
    for folder in Path("/proc").glob("[0-9]*/fd"):
        with suppress(OSError):
            if any(link.readlink() == path for link in folder.iterdir()):
                holders.append(int(folder.parent.name))
    return [holder for holder in holders if holder != os.getpid()]
