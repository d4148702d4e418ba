"""Processes that are forked from a server that has loaded what they need."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from pdtui.core.processes.process_start import prepare_processes, start_process

PATIENCE = 60.0


def tell_surroundings(told: Connection) -> None:
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    told.send((dict(os.environ), Path.cwd(), mask, os.getppid(), "torch" in sys.modules))


def start_another(told: Connection) -> None:
    start_process("another", __name__, tell_surroundings, told).join()


def wait_for_ever(told: Connection) -> None:
    told.send(os.getpid())
    signal.pause()


def _ask(target: object) -> tuple[dict[str, str], Path, set[signal.Signals], int, bool]:
    ours, theirs = multiprocessing.Pipe()
    process = start_process("asked", __name__, target, theirs)  # type: ignore[arg-type]
    theirs.close()
    assert ours.poll(PATIENCE)
    told: tuple[dict[str, str], Path, set[signal.Signals], int, bool] = ours.recv()
    process.join()
    assert process.exitcode == 0
    return told


def test_a_process_has_the_present_environment_and_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PDTUI_OF_NOW", "now")
    monkeypatch.chdir(tmp_path)
    environment, folder, _, _, _ = _ask(tell_surroundings)
    assert environment == dict(os.environ)
    assert folder == tmp_path
    monkeypatch.delenv("PDTUI_OF_NOW")
    assert "PDTUI_OF_NOW" not in _ask(tell_surroundings)[0]


def test_only_ctrl_c_is_left_to_the_process_that_started_it() -> None:
    assert _ask(tell_surroundings)[2] == {signal.SIGINT}


@pytest.mark.skipif(sys.platform != "linux", reason="forks on Linux only")
def test_what_the_server_has_loaded_is_there_also_for_the_processes_of_processes() -> None:
    prepare_processes("nothing.that.exists")  # the server runs, and keeps what it has
    *_, server, loaded = _ask(tell_surroundings)
    assert loaded
    assert server != os.getpid()
    *_, grandparent, loaded_too = _ask(start_another)
    assert (grandparent, loaded_too) == (server, loaded)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_signals_to_the_group_end_the_process_and_leave_the_server() -> None:
    ours, theirs = multiprocessing.Pipe()
    process = start_process("waiting", __name__, wait_for_ever, theirs)
    assert ours.poll(PATIENCE)
    pid = ours.recv()
    server = _ask(tell_surroundings)[3]
    for number in (signal.SIGHUP, signal.SIGTERM):
        os.kill(server, number)
    os.kill(pid, signal.SIGTERM)  # not SIGHUP, which `nohup` lets all processes ignore
    process.join(PATIENCE)
    assert process.exitcode == -signal.SIGTERM
    assert _ask(tell_surroundings)[3] == server
