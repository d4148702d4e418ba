"""Drives without a screen that are ended at random moments."""

from __future__ import annotations

import mmap
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

from pdtui.sessions.session_integrity import examine_session
from tests.faults.fault_bench import ROOT, FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost
from tests.faults.killed_simulations import SIGNALS

HEADLESS_LOSS = 3
"""Control steps of a drive without a screen that may be missing after a SIGKILL."""

PATIENCE = 120.0
_ENDLESS = 1_000_000_000
_COUNTER = struct.Struct("<q")


def kill_headless_drives(bench: FaultBench, number: int) -> list[FaultTally]:
    """End so many drives, by each signal in turn, behind their first step."""
    tallies = []
    for place, ending in enumerate(SIGNALS):
        tally = FaultTally(f"{ending.name} of a drive without a screen")
        for one in range(place, number, len(SIGNALS)):
            path = bench.folder / f"headless{one}.rrd"
            with tally.try_fault(path.name):
                _kill(bench, path, ending, tally)
        tallies.append(tally)
    return tallies


def kill_starting_headless_drives(bench: FaultBench, number: int) -> list[FaultTally]:
    """End so many drives while they start: there must be no file, or one with steps."""
    tally = FaultTally("any signal while a drive without a screen starts")
    none = 0
    for one in range(number):
        path = bench.folder / f"headless-start{one}.rrd"
        ending = SIGNALS[one % len(SIGNALS)]
        with tally.try_fault(f"{path.name}, {ending.name}"):
            arguments = bench.drive_arguments(path, "--steps", "300")
            child = start_pdtui(bench, arguments)
            # Every other one at the moment at which the file appears, or soon after.
            end = time.monotonic() + (bench.drawn.uniform(0.0, 4.0) if one % 2 else PATIENCE)
            while time.monotonic() < end and not path.exists() and child.poll() is None:
                time.sleep(0.001)
            time.sleep(0.0 if one % 2 else bench.drawn.uniform(0.0, 0.02))
            child.send_signal(ending)
            child.communicate(timeout=PATIENCE)
            if not path.exists():
                none += 1
                tally.whole += 1
                if child.returncode == 0:
                    raise FalseReport("exit code 0, but there is no file")
                continue
            whole, missing = bench.judge_ended_drive(path, 1, loss=0)
            if not whole and child.returncode == 0:
                raise FalseReport("exit code 0, but the file is not whole")
            if whole:
                tally.whole += 1
            else:
                tally.mend(missing)
    tally.notes.append(f"{none} left no file, {number - none} one with steps")
    return [tally]


def start_pdtui(bench: FaultBench, arguments: list[str]) -> subprocess.Popen[str]:
    """Start `pdtui` in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "pdtui", *arguments],
        env=bench.environment,
        cwd=bench.folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def _kill(bench: FaultBench, path: Path, ending: signal.Signals, tally: FaultTally) -> None:
    counter = path.with_suffix(".steps")
    counter.write_bytes(_COUNTER.pack(0))
    if ending == signal.SIGKILL:
        # The same drive as the command's, which also counts, so that it is known what was driven.
        command = [sys.executable, "-m", __spec__.name, str(bench.map_path), str(path), str(counter)]
        child = subprocess.Popen(
            command,
            cwd=ROOT,
            env=bench.environment,
            text=True,
            stderr=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
    else:
        child = start_pdtui(bench, bench.drive_arguments(path, "--steps", str(_ENDLESS)))
    deadline = time.monotonic() + PATIENCE
    while not path.exists():
        if time.monotonic() > deadline or child.poll() is not None:
            raise StepsLost(f"nothing was recorded: {child.communicate()[1]}")
        time.sleep(0.01)
    time.sleep(bench.drawn.uniform(0.0, 0.5))
    child.send_signal(ending)
    _, said = child.communicate(timeout=PATIENCE)
    driven = _COUNTER.unpack(counter.read_bytes())[0]
    whole, missing = bench.judge_ended_drive(path, driven, loss=HEADLESS_LOSS if driven else 0)
    path.with_suffix(".repaired.rrd").unlink(missing_ok=True)
    if whole:
        tally.whole += 1
    else:
        tally.mend(missing)
    if ending != signal.SIGKILL:
        if not whole:
            raise StepsLost("was not closed whole")
        steps = examine_session(path).steps
        if child.returncode == 0 or f"{steps} steps, recorded in {path}" not in said:
            raise FalseReport(f"{steps} steps are there; code {child.returncode}: {said}")
    path.unlink()


def drive_and_count(map_path: Path, path: Path, counter: Path) -> None:
    """Drive and record until killed, and leave the number of steps that were recorded in a file."""
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.driving.headless_drive import drive_headless
    from pdtui.driving.loop_builder import build_control_loop
    from pdtui.sessions.writer.recorder_process import RecorderProcess
    from pdtui.stimulation.map_reader import load_map

    loop = build_control_loop(DriveConfig("ant", load_map(map_path), 1))
    recorder = RecorderProcess().begin_recording(path, loop.info)
    with counter.open("r+b") as file, mmap.mmap(file.fileno(), _COUNTER.size) as shared:

        def count() -> str:
            _COUNTER.pack_into(shared, 0, loop.step)
            return ""

        drive_headless(loop, {}, _ENDLESS, recorder, count)


if __name__ == "__main__":
    drive_and_count(*map(Path, sys.argv[1:]))
