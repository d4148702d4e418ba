"""Recordings under faults: a few of each kind, and the whole table of `python -m tests.faults`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.faults.__main__ import KINDS
from tests.faults.damaged_files import cut_ends, flip_bits
from tests.faults.fault_bench import FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost
from tests.faults.killed_simulations import kill_simulations
from tests.faults.rival_drives import drive_into_one_file

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc")


@pytest.fixture
def bench(map_path: Path, tmp_path: Path) -> FaultBench:
    return FaultBench(tmp_path, map_path, seed=1)


@pytest.mark.parametrize(
    ("faults", "number"), [(flip_bits, 12), (cut_ends, 6), (kill_simulations, 3), (drive_into_one_file, 3)]
)
def test_nothing_is_lost_in_a_few_faults(
    faults: Callable[[FaultBench, int], list[FaultTally]], number: int, bench: FaultBench
) -> None:
    for tally in faults(bench, number):
        assert not tally.troubles
        assert (tally.lost, tally.lied) == (0, 0)
        assert tally.whole + tally.refused + tally.mended >= tally.tried > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_lost_in_many_faults(kind: str, bench: FaultBench) -> None:
    faults, number = KINDS[kind]
    for tally in faults(bench, number):
        print(tally.format_row())
        assert not tally.troubles


def test_what_goes_wrong_is_counted() -> None:
    tally = FaultTally("a kind of fault")
    for error in (StepsLost("steps 3… are missing"), FalseReport("is reported as whole"), OSError("broken")):
        with tally.try_fault("a.rrd"):
            raise error
    assert (tally.tried, tally.lost, tally.lied, tally.bad) == (3, 2, 1, 3)
    assert tally.format_row().splitlines()[1:] == [
        "  a.rrd: steps 3… are missing",
        "  a.rrd: is reported as whole",
        "  a.rrd: OSError: broken",
    ]
