"""The file, or its folder, is deleted, renamed or replaced while a drive is recorded into it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from pdtui.sessions.session_integrity import examine_session
from tests.faults.fault_bench import FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost
from tests.faults.watched_drive import WatchedDrive, run_watched_drives

_AFTER = 1.0
_OTHER = b"somebody else's"


def _delete(path: Path) -> None:
    path.unlink()


def _rename(path: Path) -> None:
    path.rename(path.with_name("renamed.rrd"))


def _replace(path: Path) -> None:
    other = path.with_name("other")
    other.write_bytes(_OTHER)
    other.rename(path)


def _remove_folder(path: Path) -> None:
    shutil.rmtree(path.parent)


def _rename_folder(path: Path) -> None:
    path.parent.rename(path.parent.with_name(f"{path.parent.name}-renamed"))


DISTURBANCES: dict[str, Callable[[Path], None]] = {
    "the file is deleted during a drive": _delete,
    "the file is renamed during a drive": _rename,
    "the file is replaced by another during a drive": _replace,
    "the folder is removed during a drive": _remove_folder,
    "the folder is renamed during a drive": _rename_folder,
}


def move_files(bench: FaultBench, number: int) -> list[FaultTally]:
    """Disturb so many drives in each way."""
    return [_disturb(bench, kind, disturb, number) for kind, disturb in DISTURBANCES.items()]


def _disturb(bench: FaultBench, kind: str, disturb: Callable[[Path], None], number: int) -> FaultTally:
    tally = FaultTally(kind)
    shown: list[bool] = []

    def begin(one: int) -> WatchedDrive:
        folder = bench.folder / f"{disturb.__name__}{one}"
        folder.mkdir()
        return WatchedDrive(bench, folder / "drive.rrd", lambda drive: disturb(drive.path), after=_AFTER)

    def judge(drive: WatchedDrive) -> None:
        with tally.try_fault(drive.path.parent.name):
            said = drive.last_words
            place = Path(said.rpartition("recorded in ")[2])
            if not place.is_file():
                raise StepsLost(f"the last line names no file: {said}")
            shown.append(any(str(place) in notice for notice in drive.notices))
            if not examine_session(place).whole:
                raise FalseReport(f"{place} is said to be recorded but is not whole")
            bench.judge_ended_drive(place, drive.driven, loss=0)
            if disturb is _replace and drive.path.read_bytes() != _OTHER:
                raise StepsLost("somebody else's file was overwritten")
            tally.whole += 1

    run_watched_drives(number, begin, judge)
    tally.notes.append(f"all say at their end where the recording is, {sum(shown)} of {len(shown)} at once")
    return tally
