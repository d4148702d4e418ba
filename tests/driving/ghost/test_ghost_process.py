"""A drive in its own process, with a ghost in another one, which may be stopped or killed."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.outcome import Outcome
from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.core.processes.test_worker_pool import is_alive
from tests.process_tree import list_siblings

PATIENCE = 120.0
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


def _until(connection: DriveClient, wanted: Callable[[DriveSnapshot], bool]) -> DriveSnapshot:
    """Poll until a snapshot is as wanted."""
    last = None
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        message = connection.poll_message()
        if isinstance(message, DriveSnapshot):
            last = message
            if wanted(message):
                return message
        time.sleep(0.01)
    raise AssertionError(f"nothing as wanted in {PATIENCE:g} s; last: {last}")


def _runs(snapshot: DriveSnapshot) -> bool:
    """Whether the ghost is running and no more than a few steps behind."""
    ghost = snapshot.ghost
    return ghost is not None and ghost.latest is not None and snapshot.step - ghost.latest.step < 5


def _is(condition: str) -> Callable[[DriveSnapshot], bool]:
    return lambda snapshot: snapshot.ghost is not None and snapshot.ghost.condition == condition


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return tmp_path / "drive.rrd"


@pytest.fixture
def connection(small_map: StimulationMap, recording: Path) -> Iterator[DriveClient]:
    connection = DriveClient(DriveConfig("ant", small_map, 3, recording=str(recording)))
    try:
        _until(connection, lambda snapshot: snapshot.step > 0)
        yield connection
    finally:
        connection.close()


def _turn_on(connection: DriveClient) -> int:
    """Turn the ghost on and latch a behavior; the id of the ghost's process."""
    before = list_siblings(connection.pid)
    connection.toggle_ghost()
    _until(connection, _is("waiting"))
    connection.press_key("w")
    _until(connection, _runs)
    (ghost,) = list_siblings(connection.pid) - before
    return ghost


def test_a_session_is_the_same_with_and_without_a_ghost(
    small_map: StimulationMap, connection: DriveClient, recording: Path
) -> None:
    _turn_on(connection)
    connection.press_key("t")
    first = _until(connection, lambda snapshot: snapshot.ghost is not None and snapshot.ghost.first > 0)
    connection.press_key("plus")
    connection.press_key("backspace")
    _until(connection, lambda snapshot: snapshot.step > first.step + 20)
    connection.close()
    with_ghost = read_session(recording)
    assert [event.key for event in with_ghost.events][:2] == ["w", "t"]
    loop = build_control_loop(DriveConfig("ant", small_map, 3))
    digests = []
    for step in range(with_ghost.steps):
        record = loop.advance([event for event in with_ghost.events if event.step == step])
        assert record.outcome is not Outcome.DIVERGED
        digests.append(record.digest)
    np.testing.assert_array_equal(with_ghost.digests, digests)
    assert replay_session(recording).identical


def test_a_ghost_that_is_off_has_no_process(connection: DriveClient) -> None:
    ghost = _turn_on(connection)
    connection.toggle_ghost()
    off = _until(connection, lambda snapshot: snapshot.ghost is None)
    _until(connection, lambda snapshot: snapshot.step > off.step + 5)
    assert not is_alive(ghost)


def test_a_killed_ghost_is_said_and_the_drive_goes_on(connection: DriveClient, recording: Path) -> None:
    os.kill(_turn_on(connection), signal.SIGKILL)
    failed = _until(connection, _is("failed"))
    assert failed.ghost is not None
    assert failed.ghost.message == "no ghost: it was killed by SIGKILL"
    assert failed.notice == failed.ghost.message
    later = _until(connection, lambda snapshot: snapshot.step > failed.step + 20)
    assert later.active_behaviors[0].name == "push"
    connection.toggle_ghost()
    again = _until(connection, _runs)
    assert again.ghost is not None
    assert again.ghost.first > later.step - 1
    assert connection.close().startswith("stopped: ")
    assert replay_session(recording).identical


def test_a_stopped_ghost_does_not_hold_the_drive_up_and_catches_up(connection: DriveClient) -> None:
    ghost = _turn_on(connection)
    os.kill(ghost, signal.SIGSTOP)
    try:
        stopped = _until(connection, lambda _: True)
        behind = _until(connection, lambda snapshot: snapshot.step > stopped.step + 40)
        assert behind.ghost is not None
        assert behind.ghost.latest is not None
        assert behind.ghost.latest.step < behind.step - 30
    finally:
        os.kill(ghost, signal.SIGCONT)
    _until(connection, _runs)


def test_the_ghost_waits_with_a_paused_drive_and_follows_its_single_steps(connection: DriveClient) -> None:
    _turn_on(connection)
    connection.change_pace("pause")
    paused = _until(connection, lambda snapshot: snapshot.paused)

    def caught_up(snapshot: DriveSnapshot) -> bool:
        return snapshot.ghost is not None and (
            snapshot.ghost.latest is not None and snapshot.ghost.latest.step == snapshot.step
        )

    assert _until(connection, caught_up).step == paused.step
    connection.change_pace("step")
    _until(connection, lambda snapshot: snapshot.step == paused.step + 1 and caught_up(snapshot))


def test_a_killed_simulation_takes_its_ghost_along(connection: DriveClient) -> None:
    ghost = _turn_on(connection)
    os.kill(connection.pid, signal.SIGKILL)
    deadline = time.monotonic() + PATIENCE
    while is_alive(ghost) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not is_alive(ghost)


def test_a_session_that_is_watched_can_have_a_ghost(
    small_map: StimulationMap, connection: DriveClient, recording: Path
) -> None:
    connection.press_key("w")
    pressed = _until(connection, lambda snapshot: bool(snapshot.active_behaviors))
    _until(connection, lambda snapshot: snapshot.step > pressed.step + 5)
    connection.close()
    watching = DriveClient(DriveConfig("ant", small_map, 3, watched=read_session_header(recording)))
    try:
        watching.change_pace("pause")
        watching.toggle_ghost()
        _until(watching, _is("waiting"))
        watching.change_pace("pause")
        last = _until(watching, lambda snapshot: bool(snapshot.finished))
        assert last.finished.startswith("identical, ")
        assert last.ghost is not None
        assert last.ghost.first == read_session(recording).events[0].step
    finally:
        watching.close()
