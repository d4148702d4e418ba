"""The real program in a pseudo-terminal, of which the screen, the simulation or both are ended."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from pdtui.core.errors import PdtuiError
from pdtui.sessions.session_integrity import examine_session
from tests.faults.fault_bench import FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost
from tests.faults.killed_simulations import SIGNALS
from tests.process_tree import find_simulation, list_descendants
from tests.soak import Terminal

PATIENCE = 120.0
_TARGETS = ("the screen's process", "the simulation of a screen", "screen and simulation at once")
_KEYS = (b"w", b"t", b"h", b" ", b"r", b"\x7f")


def kill_screens(bench: FaultBench, number: int) -> list[FaultTally]:
    """End so many drives on a screen, of each target by each signal in turn."""
    tallies = []
    for place, target in enumerate(_TARGETS):
        tally = FaultTally(f"{', '.join(one.name for one in SIGNALS)} of {target}")
        for one in range(place, number, len(_TARGETS)):
            ending = SIGNALS[one // len(_TARGETS) % len(SIGNALS)]
            path = bench.folder / f"screen{one}.rrd"
            with tally.try_fault(f"{path.name}, {ending.name}"), _Screen(bench, path) as screen:
                screen.drive(bench.drawn.uniform(0.0, 2.0))
                before = count_readable_steps(path)
                code = screen.kill(place, ending)
                # A screen that is killed cannot be told; but its simulation closes the recording.
                whole, _ = bench.judge_ended_drive(path, before, loss=0)
                if not whole and (ending != signal.SIGKILL or place == 0):
                    raise StepsLost("was not closed whole")
                if not whole and code == 0:
                    raise FalseReport("exit code 0, but the file is not whole")
                if whole:
                    tally.whole += 1
                else:
                    tally.mend(0)
        tallies.append(tally)
    return tallies


def kill_starting_screens(bench: FaultBench, number: int) -> list[FaultTally]:
    """End so many drives while they start: there must be no file, or one with steps."""
    tally = FaultTally("any of these while a drive starts")
    none = 0
    for one in range(number):
        ending, place = SIGNALS[one % len(SIGNALS)], one // len(SIGNALS) % len(_TARGETS)
        path = bench.folder / f"start{one}.rrd"
        with (
            tally.try_fault(f"{path.name}, {ending.name} of {_TARGETS[place]}"),
            _Screen(bench, path) as screen,
        ):
            # Every other one at the moment at which the file appears.
            end = time.monotonic() + (bench.drawn.uniform(0.0, 5.0) if one % 2 else PATIENCE)
            while time.monotonic() < end and not path.exists():
                screen.read_for(0.01)
            screen.kill(place, ending)
            if not path.exists():
                none += 1
                tally.whole += 1
                continue
            if not examine_session(path).steps:
                raise StepsLost("left a file without steps")
            whole, _ = bench.judge_ended_drive(path, 1, loss=0)
            if whole:
                tally.whole += 1
            else:
                tally.mend(0)
    tally.notes.append(f"{none} left no file, {number - none} one with steps")
    return [tally]


def count_readable_steps(path: Path) -> int:
    """Return how many steps a recording has so far; 0 if it cannot be read yet."""
    try:
        return examine_session(path).steps
    except PdtuiError:
        return 0


class _Screen(Terminal):
    """`pdtui drive` that is recorded into a file."""

    def __init__(self, bench: FaultBench, path: Path) -> None:
        self._bench, self._path = bench, path
        with pytest.MonkeyPatch.context() as patch:
            for name, value in bench.environment.items():
                patch.setenv(name, value)
            super().__init__(["ant", "--map", str(bench.map_path), "--record", str(path)])

    def __enter__(self) -> _Screen:
        return self

    def __exit__(self, *_: object) -> None:
        simulations = list_descendants(self.pid)
        self.close()
        _end(simulations)

    def drive(self, seconds: float) -> None:
        """Press keys for so long once the first step is recorded."""
        deadline = time.monotonic() + PATIENCE
        while not self._path.exists():
            if time.monotonic() > deadline or not self.read_for(0.05):
                raise StepsLost("nothing was recorded")
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.send(self._bench.drawn.choice(_KEYS))
            self.read_for(0.05)

    def kill(self, place: int, ending: signal.Signals) -> int:
        """Signal a target, wait until screen and simulation are gone, and return the screen's exit code."""
        children = list_descendants(self.pid)
        simulation = find_simulation(self.pid)
        targets = [pid for pid in ((self.pid,), (simulation,), (self.pid, simulation))[place] if pid]
        for pid in targets or [self.pid]:
            os.kill(pid, ending)
        deadline = time.monotonic() + PATIENCE
        # The exit status is only looked at here; closing the terminal takes it.
        while (ended := os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)) is None:
            if not self.read_for(0.05):
                time.sleep(0.05)
            if time.monotonic() > deadline:
                raise StepsLost(f"the screen did not end in {PATIENCE:g} s")
        while any(_is_alive(pid) for pid in children):
            self.read_for(0.05)
            time.sleep(0.01)
            if time.monotonic() > deadline:
                raise StepsLost(f"the simulation did not end in {PATIENCE:g} s")
        return ended.si_status


def _is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def _end(pids: Sequence[int]) -> None:
    for pid in pids:
        if _is_alive(pid):
            os.kill(pid, signal.SIGKILL)
