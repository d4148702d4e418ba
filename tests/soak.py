"""Random keys, resizes and pauses on the real screen, for long: does it grow, slow down, or stop repeating?

``python -m tests.soak --presses 100000`` prints the figures.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import pty
import random
import select
import signal
import struct
import sys
import tempfile
import termios
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pdtui.driving.replays.replay_result import ReplayResult
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.session_reader import read_session

KEYS = (
    *(b"w", b"t", b"h", b" ", b"w", b"t", b"h", b" "),  # the map's own
    *(b"\x1b[A", b"\x1b[B", b"\x1b[C", b"\x1b[D", b"+", b"-", b"r", b"\x7f"),
    *(b"p", b"p", b"n", b",", b".", b"v", b"?", b"?", b"z", b"\t"),
)
SIZES = ((24, 80), (48, 160), (30, 100), (20, 60), (60, 200))
WINDOWS = 10
PATIENCE = 120.0
_UNSEEN = 20
"""Keys that may be pressed between two frames."""

_STILL = 0.5
"""Without a frame for so long, nothing changes on the screen; s."""

_QUERY, _ANSWER, _FRAME = b"\x1b[?2026$p", b"\x1b[?2026;2$y", b"\x1b[?2026h"
"""Asked whether frames may be bracketed; asked so, the program brackets them, and they can be counted."""


@dataclass(frozen=True)
class Window:
    """A part of the soak.

    Attributes:
        presses: keys pressed up to its end.
        screen, simulation: resident memory of the two processes at its end, bytes.
        frames: a second.
        frame_ms: processor time of the screen's process a frame, ms.
    """

    presses: int
    screen: int
    simulation: int
    frames: float
    frame_ms: float


@dataclass(frozen=True)
class Soak:
    """What came of it."""

    presses: int
    resizes: int
    events: int
    seconds: float
    windows: tuple[Window, ...]
    replay: ReplayResult


class Terminal:
    """`pdtui drive` in a pseudo-terminal that is read all the time."""

    def __init__(self, arguments: Iterable[str]) -> None:
        self.frames = 0
        self._tail = b""
        self.pid, self._handle = pty.fork()
        if self.pid == 0:
            os.environ["TERM"] = "xterm-256color"
            os.execv(sys.executable, [sys.executable, "-m", "pdtui", "drive", *arguments])
        self.resize(SIZES[0])

    def resize(self, size: tuple[int, int]) -> None:
        fcntl.ioctl(self._handle, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))

    def send(self, keys: bytes) -> None:
        os.write(self._handle, keys)

    def read_for(self, seconds: float, until: bytes = b"") -> bool:
        """Read; whether `until` was seen, or, without one, whether the program still runs."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if not select.select([self._handle], [], [], left)[0]:
                break
            try:
                came = os.read(self._handle, 1 << 16)
            except OSError:
                return False
            if not came:
                return False
            seen = self._tail + came
            if _QUERY in seen:
                self.send(_ANSWER)
                seen = seen.replace(_QUERY, b"")
            self.frames += seen.count(_FRAME) - self._tail.count(_FRAME)
            self._tail = seen[-32:]
            if until and until in seen:
                return True
        return not until

    def close(self) -> None:
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        os.close(self._handle)


def soak(
    folder: Path,
    map_path: Path,
    presses: int,
    drawn: random.Random,
    *,
    rate: float = 200.0,
    say: bool = False,
) -> Soak:
    """Press keys at this rate a second, and no more than a few before the screen has drawn again: what it
    has not taken in yet would only wait in the terminal. Resize after every 200th on average.
    """
    recording = folder / "soak.rrd"
    terminal = Terminal(["ant", "--map", str(map_path), "--record", str(recording)])
    windows: list[Window] = []
    resizes = 0
    start = time.monotonic()
    try:
        if not terminal.read_for(PATIENCE, until=b"m/s"):
            raise AssertionError("the screen did not come up")
        terminal.read_for(1.0)
        simulation = _child(terminal.pid)
        cpu, frames, since = _cpu(terminal.pid), terminal.frames, time.monotonic()
        start = since
        for number in range(1, presses + 1):
            terminal.send(drawn.choice(KEYS))
            if drawn.random() < 0.005:
                terminal.resize(drawn.choice(SIZES))
                resizes += 1
            due = start + number / rate
            if not terminal.read_for(max(0.0005, due - time.monotonic())):
                raise AssertionError(f"the screen ended after {number} keys")
            if number % _UNSEEN == 0:
                # A paused drive on a screen that is too small draws nothing.
                drawn_before, patient = terminal.frames, time.monotonic() + _STILL
                while terminal.frames == drawn_before and time.monotonic() < patient:
                    terminal.read_for(0.01)
            if number % max(1, presses // WINDOWS) == 0:
                now, used = time.monotonic(), _cpu(terminal.pid)
                drawn_now = max(1, terminal.frames - frames)
                windows.append(
                    Window(
                        number,
                        _resident(terminal.pid),
                        _resident(simulation),
                        drawn_now / (now - since),
                        (used - cpu) / drawn_now * 1000,
                    )
                )
                cpu, frames, since = used, terminal.frames, now
                if say:
                    print(_row(windows[-1]), flush=True)
        seconds = time.monotonic() - start
        terminal.send(b"\x03")
        while terminal.read_for(1.0) and time.monotonic() < start + seconds + PATIENCE:
            pass
    finally:
        terminal.close()
    session = read_session(recording)
    if not session.outcome.startswith("stopped"):
        raise AssertionError(f"the drive ended with '{session.outcome}'")
    result = replay_session(recording, strict=True)
    return Soak(presses, resizes, len(session.events), seconds, tuple(windows), result)


def _row(window: Window) -> str:
    return (
        f"{window.presses:>7} presses: screen {window.screen / 1e6:.1f} MB, "
        f"simulation {window.simulation / 1e6:.1f} MB, {window.frames:.1f} frames/s, "
        f"{window.frame_ms:.1f} ms a frame"
    )


def _child(pid: int) -> int:
    """The simulation's process: the largest child (the other tracks resources)."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return max(map(int, children), key=_resident)


def _resident(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _cpu(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Run it and print the figures."""
    from tests.small_map import write_small_map

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--presses", type=int, default=100_000)
    parser.add_argument("--rate", type=float, default=200.0, help="a second")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        done = soak(
            folder,
            write_small_map(folder),
            asked.presses,
            random.Random(asked.seed),
            rate=asked.rate,
            say=True,
        )
    print(
        f"{done.presses} presses, {done.resizes} resizes in {done.seconds:.0f} s; "
        f"{done.events} events; {done.replay.verdict}"
    )
    raise SystemExit(not done.replay.identical)


if __name__ == "__main__":
    main()
