"""The screen under random keys, resizes and pauses."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.soak import WINDOWS, soak

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads memory from /proc")


def test_random_keys_leave_a_session_that_repeats(map_path: Path, tmp_path: Path) -> None:
    done = soak(tmp_path, map_path, 500, random.Random(1))
    assert done.replay.identical
    assert done.events > 100
    assert len(done.windows) == WINDOWS


@pytest.mark.slow
def test_a_hundred_thousand_keys_change_nothing(map_path: Path, tmp_path: Path) -> None:
    """In the second half, memory grows by less than a tenth, the work for a frame by less than a third."""
    done = soak(tmp_path, map_path, 100_000, random.Random(2))
    assert done.replay.identical
    half, last = done.windows[WINDOWS // 2 - 1], done.windows[-1]
    assert last.screen < 1.1 * half.screen
    assert last.simulation < 1.1 * half.simulation
    assert last.frame_ms < 1.33 * half.frame_ms
