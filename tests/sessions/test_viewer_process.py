"""The viewer ends with the command that opened it, whatever ends that."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

import pytest

from pdtui.sessions.viewer.viewer_process import CANNOT_START, run_viewer
from tests.real_viewer import free_port

SAMPLE = Path(__file__).parents[2] / "sessions" / "samples" / "ant.rrd"
# A machine that runs the whole suite may take a minute to start the viewer.
PATIENCE = 120.0
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.fixture
def mark(tmp_path: Path) -> str:
    """A word by which the processes of one test are found."""
    return str(tmp_path / "opened.rrd")


@pytest.fixture
def opening(tmp_path: Path, mark: str) -> Iterator[subprocess.Popen[bytes]]:
    """`pdtui sessions open --web`, whose real viewer serves on free ports."""
    shutil.copyfile(SAMPLE, mark)
    binary = files("rerun_cli") / "rerun"
    ports = f"--port {free_port()} --web-viewer-port {free_port()}"
    script = tmp_path / "rerun-on-free-ports"
    script.write_text(f'#!/bin/sh\nexec "{binary}" "$@" {ports} # {mark}\n')
    script.chmod(0o755)
    command = [sys.executable, "-m", "pdtui", "sessions", "open", "--web", mark]
    environment = {**os.environ, "RERUN_CLI_PATH": str(script)}
    # Where the tests run in the background, some signals are ignored, which a child would inherit.
    before = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGINT, signal.SIGHUP)}
    process = subprocess.Popen(command, env=environment, start_new_session=True)
    for number, handler in before.items():
        signal.signal(number, handler)
    yield process
    process.kill()
    process.wait()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGKILL])
def test_the_viewer_ends_with_the_command_that_opened_it(
    opening: subprocess.Popen[bytes], mark: str, number: signal.Signals
) -> None:
    assert any("rerun_cli/rerun" in command for command in processes_with_viewer(mark)), commands_with(mark)
    opening.send_signal(number)
    opening.wait(PATIENCE)
    assert not processes_of(mark)


def test_a_viewer_whose_script_is_killed_does_not_stay(tmp_path: Path, mark: str) -> None:
    """The script waits for a program that it has started, as that of the viewer does."""
    script = f"sleep 600 & kill -KILL $$ # {mark}"
    assert run_viewer(["sh", "-c", script]) == 128 + signal.SIGKILL
    assert not processes_of(mark)


def test_exit_codes_are_those_of_the_viewer(tmp_path: Path) -> None:
    assert run_viewer(["sh", "-c", "exit 0"]) == 0
    assert run_viewer(["sh", "-c", "exit 7"]) == 7
    assert run_viewer([str(tmp_path / "none")]) == CANNOT_START


def processes_of(mark: str) -> list[str]:
    """Wait until no process that has opened the file is left, and return those that are."""
    return _wait(mark, lambda found: not found)


def processes_with_viewer(mark: str) -> list[str]:
    """Wait until the viewer itself is among the processes that have opened the file, and return them.

    A process that was just forked has the command line of its parent for a moment, so their number alone
    says nothing.
    """
    return _wait(mark, lambda found: any("rerun_cli/rerun" in command for command in found))


def _wait(mark: str, done: Callable[[list[str]], bool]) -> list[str]:
    deadline = time.monotonic() + PATIENCE
    while not done(found := commands_with(mark)) and time.monotonic() < deadline:
        time.sleep(0.05)
    return found


def commands_with(word: str) -> list[str]:
    """The command lines of the processes that were told this word and still run."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if any(word in one for one in words):
            found.append(" ".join(words))
    return found
