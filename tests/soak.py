"""Random keys, clicks and resizes on the real screen, for long: does it end, grow, slow down, stop repeating?

``python -m tests.soak --presses 100000`` prints the figures.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import pty
import random
import re
import select
import signal
import struct
import sys
import tempfile
import termios
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pdtui.driving.replays.replay_result import ReplayResult
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.session_reader import read_session
from tests.process_tree import find_simulation
from tests.terminal_inputs import draw_input

SIZES = ((24, 80), (48, 160), (30, 100), (20, 60), (60, 200))
"""Rows and columns of terminals that people have."""

HOSTILE_SIZES = ((1, 1), (1, 2), (2, 300), (2, 1), (300, 2), (400, 400), (1, 400), (24, 1), (3, 17), (0, 0))
STANDARD = (48, 160)
"""The size at which windows are compared."""

RESIZED = 0.02
"""Share of resizes among the inputs."""

WINDOWS = 10
PATIENCE = 120.0
_MEASURED = 5.0
"""How long a window's frames are measured without input, s."""

_UNSEEN = 20
"""Inputs between two frames at most."""

_STILL = 0.1
"""Without a frame for so long, nothing changes on the screen; s."""

_SETTLED = 0.5
"""How long a key or a resize may take to be seen, s."""

_KEPT = 1 << 20
"""Bytes of the screen's output that are kept."""

_HELP = "↵ close".encode()
"""On the frame of the help."""

_PAST = b" steps ago"
"""In the status line while the past is shown."""

_COLORS = re.compile(rb"\x1b\[[0-9;?]*[a-zA-Z]")
_PACE = re.compile("(?:▶|⏸ (paused) at) ([0-9.]+)×".encode())
_QUERY, _ANSWER, _FRAME = b"\x1b[?2026$p", b"\x1b[?2026;2$y", b"\x1b[?2026h"
"""Asked whether frames may be bracketed; asked so, the program brackets them, and they can be counted."""


@dataclass(frozen=True)
class Window:
    """A part of the soak, measured at its end on a screen of `STANDARD` size while the drive runs on.

    Attributes:
        presses: inputs sent up to its end.
        screen, simulation: resident memory of the two processes, bytes.
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
    """What came of it; `presses` counts keys, clicks and all other inputs, and the `resizes` with them."""

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
        self.seen = b""
        self._tail = b""
        self.pid, self._handle = pty.fork()
        if self.pid == 0:
            os.environ["TERM"] = "xterm-256color"
            os.execv(sys.executable, [sys.executable, "-m", "pdtui", "drive", *arguments])
        self.resize(SIZES[0])

    def resize(self, size: tuple[int, int]) -> None:
        fcntl.ioctl(self._handle, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))

    def send(self, keys: bytes) -> None:
        """Write it all; a program that has ended is for `read_for` to notice."""
        with suppress(OSError):
            while keys:
                keys = keys[os.write(self._handle, keys) :]

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
            self.seen = (self.seen + came)[-_KEPT:]
            if until and until in seen:
                return True
        return not until

    def wait_for_frame(self) -> None:
        """Wait until the screen has drawn; a paused drive on a screen that is too small draws nothing."""
        before, patient = self.frames, time.monotonic() + _STILL
        while self.frames == before and time.monotonic() < patient:
            self.read_for(0.01)

    def resume(self) -> None:
        """Show the drive at the standard size, without the help over it, and at its usual pace."""
        patient = time.monotonic() + PATIENCE
        while time.monotonic() < patient:
            self.send(b"\x1b")  # leaves the help, the palette, a question of the bench, and the bench
            self.read_for(_SETTLED)
            self.seen = b""
            self.resize(SIZES[0])
            self.read_for(_SETTLED)
            self.resize(STANDARD)
            self.read_for(_SETTLED)
            paces = _PACE.findall(self.seen)
            paused, speed = paces[-1] if paces else (b"", b"")
            if _HELP in self.seen:
                continue
            if _PAST in self.seen:
                self.send(b"\x1b[F")
            elif not paces:
                continue
            elif paused:
                self.send(b"p")
            elif speed == b"1":
                return
            else:
                self.send(b"," if float(speed) > 1 else b".")
        raise AssertionError(f"the drive does not resume; the screen shows {self.seen[-2000:]!r}")

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
    count: int = WINDOWS,
    say: bool = False,
) -> Soak:
    """Send inputs at this rate a second, and no more than a few before the screen has drawn again: what it
    has not taken in yet would only wait in the terminal. Measure a number of windows.
    """
    recording = folder / "soak.rrd"
    terminal = Terminal(["ant", "--map", str(map_path), "--record", str(recording)])
    windows: list[Window] = []
    resizes = 0
    start = time.monotonic()
    try:
        if not terminal.read_for(PATIENCE, until=b"m/s"):
            raise AssertionError("the screen did not come up")
        simulation = find_simulation(terminal.pid)
        last: list[bytes | tuple[int, int]] = []
        due = start = time.monotonic()
        rows = {SIZES[0][0]}
        for number in range(1, presses + 1):
            if drawn.random() < RESIZED:
                size = draw_size(drawn)
                rows.add(size[0] or SIZES[0][0])  # which is in force is not known: they are taken in late
                terminal.resize(size)
                resizes += 1
                last.append(size)
            else:
                sent = draw_input(drawn)
                while find_mouse_row(sent) in rows:  # keys: one quits, one branches off
                    sent = draw_input(drawn)
                last.append(sent)
                terminal.send(sent)
            due = max(due + 1.0 / rate, time.monotonic() - 1.0)
            if not terminal.read_for(max(0.0005, due - time.monotonic())):
                raise AssertionError(
                    f"the screen ended after {number} inputs, of which the last: "
                    f"{[one[:60] for one in last]}; "
                    f"it said {_COLORS.sub(b'', terminal.seen[-20_000:]).decode(errors='replace')[-6000:]}"
                )
            if number % _UNSEEN == 0:
                terminal.wait_for_frame()
                last = last[-60:]
            if number % max(1, presses // count) == 0:
                windows.append(_measure(terminal, simulation, number))
                rows.add(STANDARD[0])
                due = time.monotonic()
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


def find_mouse_row(sent: bytes) -> int:
    """Return the row of an input of the mouse, counted from 1; 0 for any other input."""
    found = re.match(rb"\x1b\[<\d+;\d+;(\d+)[Mm]", sent)
    return int(found[1]) if found else 0


def draw_size(drawn: random.Random) -> tuple[int, int]:
    """Return rows and columns of a terminal: usual ones, hostile ones, or any."""
    anything = drawn.randint(1, 400), drawn.randint(1, 400)
    return drawn.choice((drawn.choice(SIZES), drawn.choice(SIZES), drawn.choice(HOSTILE_SIZES), anything))


def _measure(terminal: Terminal, simulation: int, number: int) -> Window:
    """Bring the screen back to the standard size and the drive to its usual pace, and measure both."""
    terminal.resume()
    cpu, frames, since = _cpu(terminal.pid), terminal.frames, time.monotonic()
    terminal.read_for(_MEASURED)
    drawn = terminal.frames - frames
    if drawn < _MEASURED:
        raise AssertionError(f"after {number} inputs the screen drew {drawn} frames in {_MEASURED:g} s")
    return Window(
        number,
        _resident(terminal.pid),
        _resident(simulation),
        drawn / (time.monotonic() - since),
        (_cpu(terminal.pid) - cpu) / drawn * 1000,
    )


def _row(window: Window) -> str:
    return (
        f"{window.presses:>7} inputs: screen {window.screen / 1e6:.1f} MB, "
        f"simulation {window.simulation / 1e6:.1f} MB, {window.frames:.1f} frames/s, "
        f"{window.frame_ms:.1f} ms a frame"
    )


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
    parser.add_argument("--rate", type=float, default=200.0, help="inputs a second")
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
        f"{done.presses} inputs, of which {done.resizes} resizes, in {done.seconds:.0f} s; "
        f"{done.events} events; {done.replay.verdict}"
    )
    raise SystemExit(not done.replay.identical)


if __name__ == "__main__":
    main()
