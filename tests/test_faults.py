"""Recordings that are killed or cut, repaired, and replayed up to their end."""

from __future__ import annotations

import random
import signal
from pathlib import Path

import pytest

from tests.faults import SIGNALS, cut_files, kill_drives


def test_a_few_cut_files_are_repaired(map_path: Path, tmp_path: Path) -> None:
    tally, troubles = cut_files(tmp_path, map_path, 12, random.Random(1))
    assert not troubles
    assert (tally.broken, tally.repaired, tally.lost) == (12, 12, 0)


@pytest.mark.parametrize("number", SIGNALS)
def test_drives_that_are_ended_at_random_moments(
    number: signal.Signals, map_path: Path, tmp_path: Path
) -> None:
    tally, troubles = kill_drives(tmp_path, map_path, number, 2, random.Random(2), at_once=2)
    assert not troubles
    assert (tally.broken, tally.repaired, tally.lost) == (2, 2, 0)


@pytest.mark.slow
def test_two_hundred_cut_files_are_repaired(map_path: Path, tmp_path: Path) -> None:
    tally, troubles = cut_files(tmp_path, map_path, 200, random.Random(3))
    assert not troubles
    assert (tally.broken, tally.repaired, tally.lost) == (200, 200, 0)


@pytest.mark.slow
@pytest.mark.parametrize("number", SIGNALS)
def test_fifty_drives_that_are_ended_by_each_signal(
    number: signal.Signals, map_path: Path, tmp_path: Path
) -> None:
    tally, troubles = kill_drives(tmp_path, map_path, number, 50, random.Random(4))
    assert not troubles
    assert (tally.broken, tally.repaired, tally.lost) == (50, 50, 0)
