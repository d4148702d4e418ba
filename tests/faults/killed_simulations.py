"""The process that simulates and records is ended at random moments of paced drives."""

from __future__ import annotations

import os
import signal

from tests.faults.fault_bench import FaultBench
from tests.faults.fault_tally import FaultTally, StepsLost
from tests.faults.watched_drive import WatchedDrive, run_watched_drives

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)
PACED_LOSS = 3
"""Control steps of a paced drive that may be missing after a SIGKILL."""


def kill_simulations(bench: FaultBench, number: int) -> list[FaultTally]:
    """End so many drives, by each signal in turn."""
    return [
        _kill(bench, ending, len(range(place, number, len(SIGNALS)))) for place, ending in enumerate(SIGNALS)
    ]


def _kill(bench: FaultBench, ending: signal.Signals, number: int) -> FaultTally:
    tally = FaultTally(f"{ending.name} of the simulation's process")

    def kill(drive: WatchedDrive) -> None:
        os.kill(drive.client.pid, ending)

    def judge(drive: WatchedDrive) -> None:
        with tally.try_fault(drive.path.name):
            loss = PACED_LOSS if ending == signal.SIGKILL else 0
            whole, missing = bench.judge_ended_drive(drive.path, drive.driven, loss=loss)
            if not whole and ending != signal.SIGKILL:
                raise StepsLost("was not closed whole")
            if str(drive.path) not in drive.last_words:
                raise StepsLost(f"the last line does not say where the recording is: {drive.last_words}")
            if whole:
                tally.whole += 1
            else:
                tally.mend(missing)

    run_watched_drives(
        number, lambda one: WatchedDrive(bench, bench.folder / f"{ending.name}{one}.rrd", kill), judge
    )
    return tally
