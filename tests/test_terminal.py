"""The real program in a real pseudo-terminal."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pexpect
import pytest

from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.drive_info import encode_drive_info
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.session_schema import INFO
from pdtui.sessions.writer.rerun_recording import RerunRecording, send_property_group
from pdtui.sessions.writer.session_file import SessionFile
from pdtui.stimulation.stimulation_map import StimulationMap

PATIENCE = 60


def _environment() -> dict[str, str]:
    """This process's environment for a terminal whose size is not what the variables say."""
    kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    return {**kept, "TERM": "xterm-256color"}


@pytest.fixture
def session(tmp_path: Path) -> Path:
    return tmp_path / "drive.rrd"


@pytest.fixture
def screen(map_path: Path, session: Path) -> Iterator[pexpect.spawn[str]]:
    arguments = [
        "-m",
        "pdtui",
        "drive",
        "ant",
        "--map",
        str(map_path),
        "--seed",
        "5",
        "--record",
        str(session),
    ]
    child = pexpect.spawn(
        sys.executable, arguments, dimensions=(24, 80), encoding="utf-8", timeout=PATIENCE, env=_environment()
    )
    yield child
    child.close(force=True)


def _outcome(session: Path) -> str:
    """What the recording ends with, once the simulation's process has written it."""
    deadline = time.monotonic() + PATIENCE
    while not (outcome := read_session(session).outcome) and time.monotonic() < deadline:
        time.sleep(0.2)
    return outcome


def _pid(screen: pexpect.spawn[str]) -> int:
    assert screen.pid is not None
    return screen.pid


def _drive_a_little(screen: pexpect.spawn[str], session: Path) -> None:
    """Press a behavior's key once the simulation runs, and wait until it is recorded."""
    deadline = time.monotonic() + PATIENCE
    while not session.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    screen.expect("vx")
    screen.send("w")
    screen.expect("latched")


def test_a_drive_in_a_terminal_replays_bit_for_bit(screen: pexpect.spawn[str], session: Path) -> None:
    _drive_a_little(screen, session)
    screen.send(" ")
    time.sleep(0.5)
    screen.send("q")
    screen.expect("stopped: ")
    screen.expect(pexpect.EOF)
    screen.wait()
    assert screen.exitstatus == 0
    recorded = read_session(session)
    assert [event.key for event in recorded.events] == ["w", "space"]
    result = replay_session(session)
    assert (result.first_difference, result.steps) == (None, recorded.steps)


def test_a_session_without_steps_cannot_be_watched(small_map: StimulationMap, session: Path) -> None:
    """Nowadays none is written, but earlier versions did."""
    info = build_control_loop(DriveConfig("ant", small_map, 5)).info
    created = "2026-01-01T00:00:00+00:00"
    recording = RerunRecording(SessionFile(session), info, created)
    recording.create_file()
    send_property_group(recording.stream, INFO, encode_drive_info(info, created))
    recording.close()
    arguments = ["-m", "pdtui", "replay", str(session), "--watch"]
    child = pexpect.spawn(
        sys.executable,
        arguments,
        dimensions=(24, 200),
        encoding="utf-8",
        timeout=PATIENCE,
        env=_environment(),
    )
    child.expect(pexpect.EOF)
    child.wait()
    said = f"pdtui: {session}: no control step is recorded, so there is nothing to watch"
    assert (child.before or "").strip() == said
    assert child.exitstatus == 1


def test_a_terminal_that_is_too_small_says_so_and_recovers(screen: pexpect.spawn[str], session: Path) -> None:
    _drive_a_little(screen, session)
    screen.setwinsize(20, 60)
    screen.expect("80")
    screen.setwinsize(24, 80)
    screen.expect("behaviors")
    screen.send("q")
    screen.expect("stopped: ")


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM])
def test_a_closed_terminal_leaves_a_whole_session(
    screen: pexpect.spawn[str], session: Path, number: signal.Signals
) -> None:
    _drive_a_little(screen, session)
    os.killpg(os.getpgid(_pid(screen)), number)
    deadline = time.monotonic() + PATIENCE
    while screen.isalive() and time.monotonic() < deadline:
        screen.expect([pexpect.TIMEOUT, pexpect.EOF], timeout=0.5)
    assert _outcome(session) in ("stopped", f"ended by {number.name}")
    assert replay_session(session).first_difference is None


def test_a_killed_screen_leaves_a_whole_session(screen: pexpect.spawn[str], session: Path) -> None:
    _drive_a_little(screen, session)
    os.kill(_pid(screen), signal.SIGKILL)
    assert _outcome(session) in ("the screen went away", "ended by SIGHUP")


def test_nothing_that_a_terminal_sends_ends_a_drive(screen: pexpect.spawn[str], session: Path) -> None:
    _drive_a_little(screen, session)
    fd = screen.child_fd
    for nonsense in (
        b"\xe9\xff\xfe",
        b"\x1b[M\xff\xff\xff",
        b"\x1b[55296u",
        b"\x1b[99999999u",
        b"\x11",
        b"\x1a",
    ):
        os.write(fd, nonsense)
        time.sleep(0.2)
    os.write(fd, b"\x1b[200~q\x1b[A\x03q\x1b[201~ ")
    for size in ((1, 1), (1, 2), (2, 300), (400, 400), (24, 80)):
        screen.setwinsize(*size)
        time.sleep(0.05)
    screen.expect("behaviors")
    screen.send("q")
    screen.expect("stopped: ")
    screen.expect(pexpect.EOF)
    screen.wait()
    assert screen.exitstatus == 0
    recorded = read_session(session)
    assert [event.key for event in recorded.events] == ["w", "space"]
    assert recorded.outcome == "stopped"


def test_a_drive_whose_terminal_is_gone_ends(screen: pexpect.spawn[str], session: Path) -> None:
    """As when its tmux session is killed: the terminal is gone before the signal has been handled."""
    _drive_a_little(screen, session)
    with Path(os.devnull).open() as nothing:
        os.dup2(nothing.fileno(), screen.child_fd)
    deadline = time.monotonic() + PATIENCE
    while screen.isalive():
        assert time.monotonic() < deadline, "the screen is still there"
        time.sleep(0.1)
    assert _outcome(session) in ("ended by SIGHUP", "stopped", "the screen went away")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--start", "upside down"), "no start 'upside down'"),
        (
            ("--map", "MAP", "--policy", "walker", "--force"),
            "expected a policy for robot 'ant', found one for 'walker'",
        ),
        (("--record", "blocked/a.rrd"), "blocked/a.rrd: cannot be written"),
    ],
)
def test_what_can_be_refused_is_refused_before_the_screen_opens(
    options: tuple[str, ...], said: str, map_path: Path, tmp_path: Path
) -> None:
    (tmp_path / "blocked").write_text("a file where a folder should be")
    child = pexpect.spawn(
        sys.executable,
        ["-m", "pdtui", "drive", "ant", *(str(map_path) if one == "MAP" else one for one in options)],
        dimensions=(24, 200),
        encoding="utf-8",
        timeout=3 * PATIENCE,
        cwd=tmp_path,
        env=_environment(),
    )
    child.expect(pexpect.EOF)
    child.wait()
    lines = (child.before or "").splitlines()
    assert child.exitstatus == 1
    assert "\x1b[?1049h" not in (child.before or ""), "the alternate screen was opened"
    assert said in lines[-1]
    assert lines[-1].startswith("pdtui: ")
    assert not (tmp_path / "sessions").exists()
