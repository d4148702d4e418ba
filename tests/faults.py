"""Break recordings in every way, repair them, and count what is lost.

``python -m tests.faults --kills 50 --cuts 200`` prints the figures.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pdtui.core.errors import PdtuiError
from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_server import PACED_ROWS_PER_WRITE
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.driving.headless_drive import events_of_pressed_keys
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_repair import repair_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_reader import load_map

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)
KEYS = ("w", "t", "h", "space", "r", "backspace")
LOSS = 3
"""Control steps that may be lost."""

PATIENCE = 120.0


@dataclass
class Tally:
    """What became of broken files."""

    broken: int = 0
    repaired: int = 0
    lost: int = 0
    worst: int = 0

    def judge(self, path: Path, driven: int, *, whole: bool = False) -> str:
        """Repair a file and count it; why it counts as lost, or nothing.

        Args:
            path: the recording.
            driven: control steps that were certainly done.
            whole: it has to need no repair.
        """
        self.broken += 1
        try:
            if whole and not examine_session(path).whole:
                raise AssertionError("was not closed whole")
            output = path.with_suffix(".repaired.rrd")
            steps = repair_session(path, output).steps
            if not examine_session(output).whole:
                raise AssertionError("is not whole after its repair")
            result = replay_session(output, strict=True)
            if not (result.identical and result.steps == steps):
                raise AssertionError(result.verdict)
            self.worst = max(self.worst, driven - steps)
            if steps < driven - LOSS:
                raise AssertionError(f"{driven} steps were driven, {steps} are there")
        except (AssertionError, PdtuiError) as error:
            self.lost += 1
            return f"{path.name}: {error}"
        self.repaired += 1
        return ""


def cut_files(folder: Path, map_path: Path, cuts: int, drawn: random.Random) -> tuple[Tally, list[str]]:
    """Drive, then cut the finished files at random bytes; what was driven is known from the file's growth."""
    tally, troubles = Tally(), []
    for number in range(max(1, cuts // 50)):
        whole = folder / f"whole{number}.rrd"
        sizes = _record(whole, map_path, seed=number, steps=drawn.randrange(60, 300), drawn=drawn)
        data = whole.read_bytes()
        for one in range(number, cuts, max(1, cuts // 50)):
            torn = folder / f"cut{one}.rrd"
            # Before the first step's time nothing was driven, so nothing can be lost.
            place = drawn.randrange(sizes[0], len(data))
            torn.write_bytes(data[:place])
            driven = sum(size <= place for size in sizes[1:])
            troubles.append(tally.judge(torn, driven))
            torn.unlink()
    return tally, [trouble for trouble in troubles if trouble]


def _record(path: Path, map_path: Path, *, seed: int, steps: int, drawn: random.Random) -> list[int]:
    """Drive as the screen's process does; the file's size before the first step and after each."""
    loop = build_control_loop(DriveConfig("ant", load_map(map_path), seed))
    recorder = SessionRecorder(path, loop.info, rows_per_write=PACED_ROWS_PER_WRITE)
    sizes = [recorder.bytes]
    for _ in range(steps):
        keys = [drawn.choice(KEYS[:4])] if drawn.random() < 0.1 else []
        recorder.write(loop.advance(events_of_pressed_keys(keys, loop)))
        sizes.append(recorder.bytes)
    recorder.close("finished")
    return sizes


def kill_drives(
    folder: Path, map_path: Path, number: signal.Signals, kills: int, drawn: random.Random, at_once: int = 3
) -> tuple[Tally, list[str]]:
    """Kill the process that simulates and records, at random moments of paced drives with random keys."""
    tally, troubles = Tally(), []
    for first in range(0, kills, at_once):
        drives = [
            _Drive(folder / f"{number.name}{kill}.rrd", map_path, number, drawn)
            for kill in range(first, min(kills, first + at_once))
        ]
        _serve(drives)
        for drive in drives:
            troubles.append(tally.judge(drive.path, drive.driven, whole=number != signal.SIGKILL))
    return tally, [trouble for trouble in troubles if trouble]


class _Drive:
    """One drive with its own process, watched as the screen would."""

    def __init__(self, path: Path, map_path: Path, number: signal.Signals, drawn: random.Random) -> None:
        self.path, self._number, self._drawn = path, number, drawn
        config = DriveConfig("ant", load_map(map_path), drawn.randrange(1000), recording=str(path))
        self._client = DriveClient(config)
        self._moment: float | None = None
        self._lasts = drawn.uniform(0.0, 2.5)
        self._killed = False
        self.driven, self.over = 0, False

    def serve(self) -> None:
        try:
            message = self._client.poll_message()
        except PdtuiError:
            self.over = True
            self._client.close()
            return
        if self._killed or not isinstance(message, DriveSnapshot):
            return
        self.driven = message.step
        now = time.monotonic()
        if self._moment is None and self.driven:
            self._moment = now + self._lasts
            for _ in range(self._drawn.randrange(3)):
                self._client.change_pace("faster")
        elif self._drawn.random() < 0.1:
            self._client.press_key(self._drawn.choice(KEYS))
        if self._moment is not None and now >= self._moment:
            os.kill(self._client.pid, self._number)
            self._killed = True


def _serve(drives: Sequence[_Drive]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not all(drive.over for drive in drives):
        if time.monotonic() > deadline:
            raise AssertionError(f"a drive did not end in {PATIENCE:g} s")
        for drive in drives:
            if not drive.over:
                drive.serve()
        time.sleep(0.002)


def main(write_map: Callable[[Path], Path]) -> int:
    """Run both and print the figures; the number of files that were lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50, help="by each signal")
    parser.add_argument("--cuts", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    drawn = random.Random(asked.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        map_path = write_map(folder)
        runs: list[tuple[str, tuple[Tally, list[str]]]] = []
        if asked.cuts:
            runs.append(("cut", cut_files(folder, map_path, asked.cuts, drawn)))
            _say(*runs[-1])
        for number in SIGNALS if asked.kills else ():
            runs.append(
                (f"ended by {number.name}", kill_drives(folder, map_path, number, asked.kills, drawn))
            )
            _say(*runs[-1])
        return sum(tally.lost for _, (tally, _) in runs)


def _say(what: str, result: tuple[Tally, list[str]]) -> None:
    tally, troubles = result
    print(
        f"{tally.broken} {what}, {tally.repaired} repaired, {tally.lost} lost; "
        f"at most {tally.worst} steps are missing",
        flush=True,
    )
    for trouble in troubles:
        print(f"  {trouble}", flush=True)


if __name__ == "__main__":
    from tests.small_map import write_small_map

    raise SystemExit(min(1, main(write_small_map)))
