"""Two drives that are recorded into a file of the same name at the same time.

Two processes load everything once; then they do one thing after the other, each at a given moment.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_session
from tests.faults import timed_command_server
from tests.faults.fault_bench import ROOT, FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost

_STEPS = 200
_LEAD = 0.05
"""Seconds from the telling to the moment."""

_OLD = b"an older recording"


@dataclass(frozen=True)
class _Ending:
    """How a drive ended: its exit code, what it wrote to standard output, and to standard error."""

    seed: int
    code: int
    output: str
    error: str

    @property
    def claims(self) -> str:
        """The file that it says it recorded."""
        return self.output.strip().rpartition("recorded in ")[2] if "recorded in " in self.output else ""


class _Rivals:
    """Two processes that run commands of `pdtui` at the same moment."""

    def __init__(self, bench: FaultBench) -> None:
        self._bench = bench
        self._children = [
            subprocess.Popen(
                [sys.executable, "-m", timed_command_server.__name__],
                env=bench.environment,
                cwd=ROOT,
                text=True,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
            )
            for _ in range(2)
        ]

    def __enter__(self) -> _Rivals:
        # The first drive of a process loads what the others find loaded.
        for child in range(2):
            self.run(self._bench.folder / f"warm{child}.rrd", only=[child])
        return self

    def __exit__(self, *_: object) -> None:
        for child in self._children:
            child.communicate()

    def run(self, path: Path, *more: str, only: list[int] | None = None) -> list[_Ending]:
        """Run the same drive in both, from other seeds."""
        moment = time.monotonic() + _LEAD
        children = [self._children[one] for one in only or (0, 1)]
        for seed, child in enumerate(children):
            # By some milliseconds, either may come first.
            at = moment + self._bench.drawn.uniform(0.0, 0.004)
            arguments = self._bench.drive_arguments(path, "--steps", str(_STEPS), "--seed", str(seed), *more)
            assert child.stdin is not None
            print(json.dumps([at, arguments]), file=child.stdin, flush=True)
        endings = []
        for seed, child in enumerate(children):
            assert child.stdout is not None
            endings.append(_Ending(seed, *json.loads(child.stdout.readline())))
        return endings


def drive_into_one_file(bench: FaultBench, number: int) -> list[FaultTally]:
    """Let so many pairs of drives begin a file, number it, and replace it."""
    begin = FaultTally("two drives on one new name")
    numbered = FaultTally("two recorders that number a taken name")
    replace = FaultTally("two drives that replace one file (--overwrite)")
    late = 0
    with _Rivals(bench) as rivals:
        for one in range(number):
            path = bench.folder / f"new{one}.rrd"
            with begin.try_fault(path.name):
                endings = rivals.run(path)
                _require_one_winner(path, endings)
                late += any("File exists" in ending.error for ending in endings)
                begin.whole += 1
                begin.refused += 1
        for one in range(number):
            path = bench.folder / f"numbered{one}.rrd"
            with numbered.try_fault(path.name):
                endings = rivals.run(path, "number")
                places = {ending.claims for ending in endings}
                if places != {str(path), str(path.with_name(f"{path.stem}-2.rrd"))}:
                    raise FalseReport(f"both say: {places}")
                for ending in endings:
                    _require_own(ending)
                numbered.whole += 1
        for one in range(number):
            path = bench.folder / f"replaced{one}.rrd"
            path.write_bytes(_OLD)
            with replace.try_fault(path.name):
                endings = rivals.run(path, "--overwrite")
                if path.read_bytes() == _OLD:
                    raise StepsLost("neither was recorded")
                _require_one_winner(path, endings)
                replace.whole += 1
                replace.refused += 1
    begin.notes.append(f"{late} were refused only when both created the file")
    return [begin, numbered, replace]


def _require_one_winner(path: Path, endings: list[_Ending]) -> None:
    winners = [ending for ending in endings if ending.claims]
    if len(winners) != 1:
        places = [ending.claims for ending in endings]
        said = [ending.error.strip() for ending in endings]
        if len(set(places)) == 2 and all(places):
            # Of two that replace a file, one may be recorded elsewhere, and say so.
            return
        raise FalseReport(f"{len(winners)} drives said that they recorded it: {places}, {said}")
    (winner,) = winners
    (loser,) = (ending for ending in endings if not ending.claims)
    if loser.code == 0 or len(loser.error.strip().splitlines()) != 1 or str(path) not in loser.error:
        raise FalseReport(f"the other ended with code {loser.code}: {loser.error!r}")
    if winner.claims != str(path):
        raise FalseReport(f"recorded in {winner.claims}")
    _require_own(winner)


def _require_own(ending: _Ending) -> None:
    path = Path(ending.claims)
    if ending.code or not examine_session(path).whole:
        raise FalseReport(f"{path} is said to be recorded, is not whole; code {ending.code}")
    session = read_session(path)
    if session.info.seed != ending.seed:
        raise StepsLost(f"{path} is that of the other drive")
    if session.steps != _STEPS:
        raise StepsLost(f"{path} has {session.steps} steps")
