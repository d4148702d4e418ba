"""The screen under random keys, clicks, resizes, pauses and garbage."""

from __future__ import annotations

import random
from pathlib import Path
from statistics import median

import pytest

from tests.soak import WINDOWS, soak

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads memory from /proc")


def test_random_input_leaves_a_session_that_repeats(map_path: Path, tmp_path: Path) -> None:
    # When a page takes the keys depends on timing: of 1500 presses, 44 to 81 did something to the drive.
    done = soak(tmp_path, map_path, 3000, random.Random(1), count=1)
    assert done.replay.identical
    assert done.events > 50
    assert done.resizes > 5
    assert len(done.windows) == 1


@pytest.mark.slow
def test_a_hundred_thousand_inputs_change_nothing(map_path: Path, tmp_path: Path) -> None:
    """In the second half, memory grows by less than a tenth, the work for a frame by less than a third."""
    done = soak(tmp_path, map_path, 100_000, random.Random(2))
    assert done.replay.identical
    half, last = done.windows[WINDOWS // 2 - 1], done.windows[-1]
    assert last.screen < 1.1 * half.screen
    assert last.simulation < 1.1 * half.simulation
    # A single window may be disturbed by what else this machine does.
    halves = done.windows[: WINDOWS // 2], done.windows[WINDOWS // 2 :]
    early, late = (median(window.frame_ms for window in windows) for windows in halves)
    assert late < 1.33 * early
