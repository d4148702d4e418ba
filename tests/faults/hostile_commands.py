"""Hostile files, read by the real command line: one line, exit code 1, little memory, little time."""

from __future__ import annotations

from importlib.util import find_spec

from tests.faults.fault_bench import FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost

MEMORY = 1 << 30
"""Bytes that a command may take."""

SECONDS = 5.0
"""Time that a command may take beyond what `pdtui --version` takes, s."""


def read_hostile_files(bench: FaultBench, number: int) -> list[FaultTally]:
    """Read so many hostile files of each kind."""
    tally = FaultTally("a hostile file")
    if find_spec("tests.hostile_files") is None:
        tally.notes.append("skipped: tests/hostile_files.py is not there")
        return [tally]
    from tests import hostile_files

    start = hostile_files.run_pdtui(("drive", "ant", "--headless", "--steps", "1")).seconds
    for kind, name in hostile_files.list_hostile_files()[:number]:
        file = hostile_files.write_hostile_file(bench.folder, kind, name)
        with tally.try_fault(f"{kind}, {name}"):
            found = hostile_files.run_pdtui(file.arguments)
            lines = found.error.strip().splitlines()
            if found.code == 0:
                raise FalseReport("exit code 0")
            if found.code != 1 or len(lines) != 1:
                raise StepsLost(f"code {found.code}, {len(lines)} lines: {found.error[-150:]}")
            if found.memory > MEMORY or found.seconds > start + SECONDS:
                raise StepsLost(f"takes {found.memory >> 20} MiB and {found.seconds - start:.1f} s")
            tally.refused += 1
        file.path.unlink()
    return [tally]
