"""The simulation's own process, driven through its pipe."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import PdtuiError, SessionError
from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.session_replay import replay_session
from pdtui.policies.weights.weights_header import hash_file
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.writer.recorder_loop import KILLED
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.real_viewer import free_port, real_viewer
from tests.small_map import write_small_weights
from tests.waiting import wait_until_whole

PATIENCE = 60.0


def _until(connection: DriveClient, wanted: Callable[[DriveSnapshot], bool]) -> list[DriveSnapshot]:
    """Poll until a snapshot is as wanted; all snapshots on the way."""
    seen: list[DriveSnapshot] = []
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        message = connection.poll_message()
        if isinstance(message, DriveSnapshot):
            seen.append(message)
            if wanted(message):
                return seen
        time.sleep(0.01)
    raise AssertionError(f"nothing as wanted in {PATIENCE} s; last: {seen[-1:]}")


def _briefing(connection: DriveClient) -> DriveFacts:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        message = connection.poll_message()
        if message is not None:
            assert isinstance(message, DriveFacts)
            return message
        time.sleep(0.01)
    raise AssertionError("no briefing")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return tmp_path / "drive.rrd"


@pytest.fixture
def connection(small_map: StimulationMap, recording: Path) -> Iterator[DriveClient]:
    connection = DriveClient(DriveConfig("ant", small_map, 3, recording=str(recording)))
    yield connection
    connection.close()


def test_a_drive_through_the_pipe_is_recorded_and_replays(connection: DriveClient, recording: Path) -> None:
    facts = _briefing(connection)
    assert (facts.title, facts.layers) == ("Ant (MuJoCo)", (16, 16))
    connection.press_key("w")
    pushed = _until(connection, lambda snapshot: bool(snapshot.active_behaviors))
    assert pushed[-1].active_behaviors[0].name == "push"
    assert {view.unit for view in pushed[-1].stimulated_units} == {3, 23}
    assert {view.overwritten for view in pushed[-1].stimulated_units} == {-2.0, 2.0}
    connection.press_key("z")
    refused = _until(connection, lambda snapshot: bool(snapshot.notice))
    assert refused[-1].notice == "no behavior has key 'z'"
    connection.press_key("space")
    cleared = _until(connection, lambda snapshot: not snapshot.active_behaviors)
    histories = [*pushed, *refused, *cleared]
    assert sum(len(snapshot.history) for snapshot in histories) == cleared[-1].step
    assert cleared[-1].involvement == 2
    assert connection.close().startswith("stopped: ")
    session = read_session(recording)
    assert [event.key for event in session.events] == ["w", "space"]
    assert session.outcome == "stopped"
    result = replay_session(recording)
    assert result.first_difference is None
    assert result.steps == session.steps


def test_the_simulation_has_the_maps_robot_options_and_says_so(small_map: StimulationMap) -> None:
    connection = DriveClient(DriveConfig("ant", replace(small_map, robot_options={"forward": "x"}), 3))
    assert _briefing(connection).title == "Ant (MuJoCo), forward = x"
    connection.close()


def test_pause_single_step_and_speed_are_no_part_of_the_run(connection: DriveClient) -> None:
    _briefing(connection)
    connection.change_pace("pause")
    paused = _until(connection, lambda snapshot: snapshot.paused)[-1].step
    connection.change_pace("step")
    assert _until(connection, lambda snapshot: snapshot.step > paused)[-1].step == paused + 1
    connection.change_pace("faster")
    assert _until(connection, lambda snapshot: snapshot.speed == 2.0)[-1].step == paused + 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_a_whole_recording(
    connection: DriveClient, recording: Path, number: signal.Signals
) -> None:
    _until(connection, lambda snapshot: snapshot.step >= 5)
    os.kill(connection.pid, number)
    with pytest.raises(PdtuiError, match=f"ended by {number.name}: "):
        _until(connection, lambda _: False)
    session = read_session(recording)
    assert session.outcome == f"ended by {number.name}"
    assert replay_session(recording).first_difference is None


def test_a_killed_simulation_says_where_the_recording_is(connection: DriveClient, recording: Path) -> None:
    steps = _until(connection, lambda snapshot: snapshot.step >= 10)[-1].step
    os.kill(connection.pid, signal.SIGKILL)
    with pytest.raises(
        PdtuiError, match=r"was killed by SIGKILL; the recording up to then is in .*drive\.rrd"
    ):
        _until(connection, lambda _: False)
    wait_until_whole(recording)
    session = read_session(recording)
    assert session.steps >= steps
    assert session.outcome == KILLED
    assert replay_session(recording).first_difference is None


def _screen_that_stops(config: DriveConfig, results: Connection) -> None:
    """Ask for a snapshot, stop before reading it, and tell the steps of two snapshots once continued."""
    client = DriveClient(config)
    while not isinstance(client.poll_message(), DriveFacts):
        time.sleep(0.01)
    os.kill(os.getpid(), signal.SIGSTOP)
    shown = [snapshot.step for snapshot in _until(client, lambda _: True)]
    shown += [snapshot.step for snapshot in _until(client, lambda _: True)]
    results.send((shown, client.close()))


def test_a_drive_goes_on_behind_a_screen_that_is_stopped(tmp_path: Path, recording: Path) -> None:
    """The snapshot of 100,000 units does not fit into the buffer of the pipe."""
    weights = write_small_weights(tmp_path / "wide.safetensors", layers=(100_000,))
    config = DriveConfig(
        "ant",
        StimulationMap("ant", str(weights), hash_file(weights), "space", {}, {}),
        3,
        recording=str(recording),
        activations="off",
    )
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    screen = context.Process(target=_screen_that_stops, args=(config, theirs))
    screen.start()
    assert screen.pid is not None
    try:
        _, status = os.waitpid(screen.pid, os.WUNTRACED)
        assert os.WIFSTOPPED(status)
        deadline = time.monotonic() + PATIENCE
        while (steps := _recorded_steps(recording)) < 60 and time.monotonic() < deadline:
            time.sleep(0.2)
        assert steps >= 60
        os.kill(screen.pid, signal.SIGCONT)
        assert ours.poll(PATIENCE)
        (_, newest), outcome = ours.recv()
    finally:
        os.kill(screen.pid, signal.SIGCONT)
        screen.join(PATIENCE)
    assert newest >= steps
    assert outcome.startswith("stopped: ")
    assert read_session(recording).outcome == "stopped"


def _recorded_steps(recording: Path) -> int:
    try:
        return examine_session(recording).steps
    except SessionError:
        return 0  # its beginning is still being written


def test_what_cannot_be_loaded_comes_up_the_pipe(small_map: StimulationMap, tmp_path: Path) -> None:
    connection = DriveClient(DriveConfig("ant", small_map, 3, policy=str(tmp_path / "gone.safetensors")))
    with pytest.raises(PdtuiError, match=r"no policy '.*gone\.safetensors'"):
        _until(connection, lambda _: False)
    connection.close()


def test_a_session_can_be_watched(
    small_map: StimulationMap, connection: DriveClient, recording: Path
) -> None:
    _until(connection, lambda snapshot: snapshot.step >= 3)
    connection.press_key("t")
    _until(connection, lambda snapshot: bool(snapshot.active_behaviors))
    connection.close()
    session = read_session(recording)
    watching = DriveClient(DriveConfig("ant", small_map, 3, watched=read_session_header(recording)))
    last = _until(watching, lambda snapshot: bool(snapshot.finished))[-1]
    watching.close()
    assert last.finished == f"identical, {session.steps} steps"
    np.testing.assert_array_equal(last.attributes, session.attributes[-1])


def test_a_drive_whose_viewer_is_not_there_says_so_and_goes_on(
    small_map: StimulationMap, recording: Path
) -> None:
    nobody = ViewerAddress(port=free_port())
    connection = DriveClient(DriveConfig("ant", small_map, 3, recording=str(recording), viewer=nobody))
    try:
        seen = _until(connection, lambda snapshot: snapshot.step > 20)
    finally:
        connection.close()
    assert any(snapshot.notice == nobody.absence_message for snapshot in seen)
    assert read_session(recording).steps > 20


@pytest.mark.viewer
def test_a_viewer_killed_in_mid_drive_leaves_drive_and_session_whole(
    small_map: StimulationMap, recording: Path
) -> None:
    with real_viewer() as viewer:
        address = ViewerAddress(port=viewer.port)
        connection = DriveClient(DriveConfig("ant", small_map, 3, recording=str(recording), viewer=address))
        try:
            viewer.wait_for(lambda state: any(view.name == "Behaviors" for view in state.views))
            (last,) = _until(connection, lambda snapshot: snapshot.step > 20)[-1:]
            viewer.kill()
            _until(connection, lambda snapshot: snapshot.step > last.step + 40)
        finally:
            outcome = connection.close()
    assert not connection.failed
    assert outcome.startswith("stopped")
    assert replay_session(recording).identical
