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
    tallies = {ending: FaultTally(f"{ending.name} of the simulation's process") for ending in SIGNALS}

    def begin(one: int) -> WatchedDrive:
        ending = SIGNALS[one % len(SIGNALS)]
        path = bench.folder / f"{ending.name}{one}.rrd"
        return WatchedDrive(bench, path, lambda drive: os.kill(drive.client.pid, ending))

    def judge(drive: WatchedDrive) -> None:
        ending = next(ending for ending in SIGNALS if drive.path.name.startswith(ending.name))
        tally = tallies[ending]
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

    run_watched_drives(number, begin, judge)
    return list(tallies.values())
