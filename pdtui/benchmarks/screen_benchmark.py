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
_PATIENCE = 120.0
"""Longest time to wait for the screen, s; a loaded machine may take a minute."""
_FRAME_SIGN, _ROBOT_SIGN = b"behaviors", b"m/s"


@dataclass(frozen=True)
class ScreenBenchmark:
    """The result of `bench_screen`, in a terminal of 160×48 cells.

    Attributes:
        first_frame: time from the command to the first frame, s.
        first_state: time from the command to the first state of the robot on the screen, s.
        cpu_share: CPU time of the screen's process during a drive, as a share of one core.
        seconds: time over which that was measured, s.
    """

    first_frame: float
    first_state: float
    cpu_share: float
    seconds: float


def bench_screen(arguments: Sequence[str], seconds: float) -> ScreenBenchmark:
    """Run ``pdtui drive`` with these arguments in a pseudo-terminal.

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
        os.write(terminal, b"q")
        _read_for(terminal, 3.0)
    finally:
        os.kill(pid, signal.SIGTERM)
        os.close(terminal)
        os.waitpid(pid, 0)
    return ScreenBenchmark(first_frame, first_state, share, seconds)


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
