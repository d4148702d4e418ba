"""`pdtui bench screen`: how soon the screen appears and what it costs, in a real pseudo-terminal.

How late control steps come is compared with the same loop at the same pace without a screen, in the same run.
"""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import tempfile
import termios
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import ScreenError
from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig

SIZE = (48, 160)
"""Rows and columns of the terminal."""
_PATIENCE = 300.0
"""Longest time to wait for the screen, s; a loaded machine may take minutes."""
_PRESSES, _LONGEST_ANSWER = 20, 10.0  # s
_ECHO_SIGN, _CONFIRMED_SIGN = b"pressed", b"latched"
_FRAME_SIGN, _ROBOT_SIGN = b"behaviors", b"m/s"


_GHOST_KEY, _GHOST_SIGN = b"\x07", b"since step"


class StepLateness(NamedTuple):
    """By how much later than it was due a control step was done: median, 99th percentile, and of how many."""

    median: float
    p99: float
    steps: int


@dataclass(frozen=True)
class ScreenBenchmark:
    """The result of `bench_screen`, in a terminal of 160×48 cells.

    Attributes:
        first_frame: time from the command to the first frame, s.
        first_state: time from the command to the first state of the robot on the screen, s.
        cpu_share: CPU time of the screen's process during a drive, as a share of one core.
        seconds: time over which that was measured, s.
        echo: times from a key of a behavior to its mark on the screen, s, in order of size; none if the map
            has no behavior that lasts until another key is pressed.
        confirmation: times from the same keys to the drive's answer on the screen, s.
        ghost_cpu_share: the same share while a ghost is shown; None where the map has no such behavior.
        lateness: how late control steps were done, s, in the same loop without a screen (``bare``), with the
            screen, and with a ghost on it.
    """

    first_frame: float
    first_state: float
    cpu_share: float
    seconds: float
    echo: tuple[float, ...] = ()
    confirmation: tuple[float, ...] = ()
    ghost_cpu_share: float | None = None
    lateness: Mapping[str, StepLateness] = field(default_factory=dict)


def bench_screen(
    config: DriveConfig, arguments: Sequence[str], seconds: float, keys: Sequence[str] = ()
) -> ScreenBenchmark:
    """Run ``pdtui drive`` with these arguments in a pseudo-terminal.

    Args:
        config: the drive of these arguments, for the loop without a screen.
        arguments: those of the command.
        seconds: how long to measure the processor's time.
        keys: what the terminal sends for the key of a behavior that stays latched, and for the key that
            clears it.

    Raises:
        ScreenError: the system has no ``/proc``, or the screen does not appear.
    """
    if not Path("/proc/self/stat").exists():
        raise ScreenError("the screen benchmark reads /proc, which this system does not have")
    with tempfile.TemporaryDirectory() as folder:
        times = Path(folder) / "steps.npy"
        bare = _drive_without_screen(replace(config, recording="", step_times=str(times)), seconds)
        start = time.monotonic()
        pid, terminal = pty.fork()
        if pid == 0:
            os.environ["TERM"] = "xterm-256color"
            timed = [*arguments, "--step-times", str(times)]
            os.execv(sys.executable, [sys.executable, "-m", "pdtui", "drive", *timed])
        ghost: tuple[float, float, float] | None = None
        try:
            fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", *SIZE, 0, 0))
            first_frame = _read_until(terminal, _FRAME_SIGN, start)
            first_state = _read_until(terminal, _ROBOT_SIGN, start)
            _read_for(terminal, 2.0)
            screen = _measure_share(pid, terminal, seconds)
            echoes = _time_keys(terminal, *keys) if keys else []
            if keys:
                os.write(terminal, _GHOST_KEY + keys[0].encode())
                _read_until(terminal, _GHOST_SIGN, time.monotonic())
                _read_for(terminal, 2.0)
                ghost = _measure_share(pid, terminal, seconds)
            os.write(terminal, b"q")
            _read_to_end(terminal)
        finally:
            os.kill(pid, signal.SIGTERM)
            os.close(terminal)
            os.waitpid(pid, 0)
        steps = np.load(times)
    echo, confirmation = zip(*echoes, strict=True) if echoes else ((), ())
    lateness = {"bare": bare, "screen": _summarize_lateness(steps, *screen[1:])}
    if ghost is not None:
        lateness["ghost"] = _summarize_lateness(steps, *ghost[1:])
    return ScreenBenchmark(
        first_frame,
        first_state,
        screen[0],
        seconds,
        tuple(sorted(echo)),
        tuple(sorted(confirmation)),
        None if ghost is None else ghost[0],
        lateness,
    )


def _drive_without_screen(config: DriveConfig, seconds: float) -> StepLateness:
    """Drive in a process of its own, as with a screen, but ask it for nothing."""
    client = DriveClient(config)
    try:
        client.wait_until_started()
        time.sleep(2.0)
        begun = time.monotonic()
        time.sleep(seconds)
        ended = time.monotonic()
    finally:
        client.close()
    return _summarize_lateness(np.load(config.step_times), begun, ended)


def _summarize_lateness(steps: Floats, begun: float, ended: float) -> StepLateness:
    late = steps[(steps[:, 0] >= begun) & (steps[:, 0] < ended), 1]
    median, p99 = np.percentile(late, [50.0, 99.0]) if len(late) else (np.nan, np.nan)
    return StepLateness(float(median), float(p99), len(late))


def _measure_share(pid: int, terminal: int, seconds: float) -> tuple[float, float, float]:
    """Return the processor's share of a process over some seconds, when they began, and when they ended."""
    before, began = _cpu_seconds(pid), time.monotonic()
    _read_for(terminal, seconds)
    ended = time.monotonic()
    return (_cpu_seconds(pid) - before) / (ended - began), began, ended


def _read_to_end(terminal: int) -> None:
    """Read until the program has closed the terminal."""
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        if select.select([terminal], [], [], 0.1)[0] and not _read(terminal, 0.0):
            return


def _time_keys(terminal: int, key: str, clear: str) -> list[tuple[float, float]]:
    """Press a behavior's key again and again; return the times to its echo and to the drive's answer, s.

    A press that is not answered is left out: it latched again what had not been cleared yet.
    """
    times = []
    for _ in range(_PRESSES):
        os.write(terminal, clear.encode())
        _read_for(terminal, 0.7)
        start = time.monotonic()
        os.write(terminal, key.encode())
        echo, seen = 0.0, b""
        while _CONFIRMED_SIGN not in seen and time.monotonic() - start < _LONGEST_ANSWER:
            seen += _read(terminal, 0.01)
            if not echo and (_ECHO_SIGN in seen or _CONFIRMED_SIGN in seen):
                echo = time.monotonic() - start
        if _CONFIRMED_SIGN in seen:
            times.append((echo, time.monotonic() - start))
    return times


def _read_until(terminal: int, sign: bytes, start: float) -> float:
    seen = b""
    while time.monotonic() - start < _PATIENCE:
        seen += _read(terminal, 0.05)
        if sign in seen:
            return time.monotonic() - start
    raise ScreenError(
        f"the screen did not show '{sign.decode()}' within {_PATIENCE:g} s; it showed {seen[-200:]!r}"
    )


def _read_for(terminal: int, seconds: float) -> None:
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        _read(terminal, min(left, 0.05))


def _read(terminal: int, wait: float) -> bytes:
    """Return what the terminal received within `wait` seconds; nothing when its program has ended."""
    if not select.select([terminal], [], [], wait)[0]:
        return b""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""


def _cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
