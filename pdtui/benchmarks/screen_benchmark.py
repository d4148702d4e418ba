"""`pdtui bench screen`: how soon the screen appears and what it costs, in a real pseudo-terminal."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import termios
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pdtui.core.errors import ScreenError

SIZE = (48, 160)
"""Rows and columns of the terminal."""
_PATIENCE = 300.0
"""Longest time to wait for the screen, s; a loaded machine may take minutes."""
_PRESSES, _LONGEST_ANSWER = 20, 10.0  # s
_ECHO_SIGN, _CONFIRMED_SIGN = b"pressed", b"latched"
_FRAME_SIGN, _ROBOT_SIGN = b"behaviors", b"m/s"


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
    """

    first_frame: float
    first_state: float
    cpu_share: float
    seconds: float
    echo: tuple[float, ...] = ()
    confirmation: tuple[float, ...] = ()


def bench_screen(arguments: Sequence[str], seconds: float, keys: Sequence[str] = ()) -> ScreenBenchmark:
    """Run ``pdtui drive`` with these arguments in a pseudo-terminal.

    Args:
        arguments: those of the command.
        seconds: how long to measure the processor's time.
        keys: what the terminal sends for the key of a behavior that stays latched, and for the key that
            clears it.

    Raises:
        ScreenError: the system has no ``/proc``, or the screen does not appear.
    """
    if not Path("/proc/self/stat").exists():
        raise ScreenError("the screen benchmark reads /proc, which this system does not have")
    start = time.monotonic()
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ["TERM"] = "xterm-256color"
        os.execv(sys.executable, [sys.executable, "-m", "pdtui", "drive", *arguments])
    try:
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", *SIZE, 0, 0))
        first_frame = _read_until(terminal, _FRAME_SIGN, start)
        first_state = _read_until(terminal, _ROBOT_SIGN, start)
        _read_for(terminal, 2.0)
        before, began = _cpu_seconds(pid), time.monotonic()
        _read_for(terminal, seconds)
        share = (_cpu_seconds(pid) - before) / (time.monotonic() - began)
        echoes = _time_keys(terminal, *keys) if keys else []
        os.write(terminal, b"q")
        _read_for(terminal, 3.0)
    finally:
        os.kill(pid, signal.SIGTERM)
        os.close(terminal)
        os.waitpid(pid, 0)
    echo, confirmation = zip(*echoes, strict=True) if echoes else ((), ())
    return ScreenBenchmark(
        first_frame, first_state, share, seconds, tuple(sorted(echo)), tuple(sorted(confirmation))
    )


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
