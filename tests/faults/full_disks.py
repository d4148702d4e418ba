"""Disks that fill up while a drive is recorded: limits on the file's size, and a small file system."""

from __future__ import annotations

import resource
import signal
import subprocess
import time
from pathlib import Path

from pdtui.core.errors import PdtuiError
from pdtui.sessions.session_integrity import examine_session
from tests.faults.fault_bench import FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost
from tests.faults.killed_headless_drives import PATIENCE, start_pdtui

_ENDLESS = "1000000000"
_SMALLEST, _LARGEST = 3_000_000, 10_000_000
_LATE = 400_000


def fill_disks(bench: FaultBench, number: int) -> list[FaultTally]:
    """Limit the size of so many files from the beginning, and of so many during the drive."""
    early = FaultTally("a disk that is full after some time")
    late = FaultTally("a disk that others fill all of a sudden")
    for one in range(number):
        path = bench.folder / f"early{one}.rrd"
        with early.try_fault(path.name):
            child = start_pdtui(bench, bench.drive_arguments(path, "--steps", _ENDLESS))
            _limit(child, bench.drawn.randrange(_SMALLEST, _LARGEST))
            _judge(bench, path, child, early, 0)
    for one in range(number):
        path = bench.folder / f"late{one}.rrd"
        with late.try_fault(path.name):
            child = start_pdtui(bench, bench.drive_arguments(path, "--steps", _ENDLESS))
            steps = _record_a_little(bench, path, child)
            _limit(child, path.stat().st_size + bench.drawn.randrange(_LATE))
            child.send_signal(signal.SIGCONT)
            _judge(bench, path, child, late, steps)
    return [early, late]


def fill_small_file_systems(bench: FaultBench, number: int) -> list[FaultTally]:
    """Record into a file system in memory that is too small, and into one that another file fills."""
    tally = FaultTally("a really small file system")
    mounted = bench.folder / "small"
    mounted.mkdir()
    for one in range(number):
        size = bench.drawn.randrange(3_000_000, 9_000_000)
        command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(mounted)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            tally.notes.append(f"skipped: {done.stderr.strip()}")
            break
        path = mounted / "a.rrd"
        try:
            with tally.try_fault(f"{size} bytes{', filled' if one % 2 else ''}"):
                child = start_pdtui(bench, bench.drive_arguments(path, "--steps", _ENDLESS))
                steps = 0
                if one % 2:
                    steps = _record_a_little(bench, path, child)
                    _fill(mounted)
                    child.send_signal(signal.SIGCONT)
                _judge(bench, path, child, tally, steps)
        finally:
            subprocess.run(["umount", str(mounted)], check=True)
    return [tally]


def _limit(child: subprocess.Popen[str], size: int) -> None:
    resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def _fill(folder: Path) -> None:
    try:
        with (folder / "other").open("wb", buffering=0) as other:
            while True:
                other.write(bytes(4096))
    except OSError:
        return


def _record_a_little(bench: FaultBench, path: Path, child: subprocess.Popen[str]) -> int:
    """Wait until there are steps, stop the process, and return their number."""
    deadline = time.monotonic() + PATIENCE
    while not path.exists():
        if time.monotonic() > deadline or child.poll() is not None:
            raise StepsLost(f"nothing was recorded: {child.communicate()[1]}")
        time.sleep(0.01)
    time.sleep(bench.drawn.uniform(0.0, 0.3))
    child.send_signal(signal.SIGSTOP)
    try:
        return examine_session(path).steps
    except PdtuiError:
        return 0


def _judge(
    bench: FaultBench, path: Path, child: subprocess.Popen[str], tally: FaultTally, steps: int
) -> None:
    _, said = child.communicate(timeout=PATIENCE)
    if child.returncode == 0 or len(said.strip().splitlines()) != 1 or str(path) not in said:
        raise FalseReport(f"code {child.returncode}: {said!r}")
    if not path.exists():
        if steps:
            raise StepsLost("the file is gone")
        tally.refused += 1
        return
    # The repaired file needs space itself.
    kept = bench.folder / f"kept-{path.name}"
    kept.write_bytes(path.read_bytes())
    whole, missing = bench.judge_ended_drive(kept, steps, loss=0)
    if whole != ("is complete" in said):
        raise FalseReport(f"whole: {whole}; {said.strip()}")
    if whole:
        tally.whole += 1
    else:
        tally.mend(missing)
    for file in (path, kept, kept.with_suffix(".repaired.rrd")):
        file.unlink(missing_ok=True)
