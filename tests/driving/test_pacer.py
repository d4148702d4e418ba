"""Pacing on a clock of the test's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdtui.driving.pacer import Pacer


def _run(pacer: Pacer, start: float, seconds: float) -> int:
    """Steps done by a caller that waits as it is told."""
    now, steps = start, 0
    while now < start + seconds - 1e-6:
        wait = pacer.seconds_until_due(now)
        if wait is None:
            return steps
        if wait > 1e-9:
            now += wait
            continue
        pacer.note_step(now)
        steps += 1
    return steps


def test_real_time_and_its_multiples() -> None:
    pacer = Pacer(0.05, 0.0)
    assert _run(pacer, 0.0, 1.0) == 20
    pacer.change_pace("faster", 1.0)
    assert pacer.speed == 2.0
    assert _run(pacer, 1.0, 1.0) == 40
    assert pacer.achieved_speed == pytest.approx(2.0)
    for _ in range(2):
        pacer.change_pace("slower", 2.0)
    assert _run(pacer, 2.0, 2.0) == 20


def test_pause_and_single_steps() -> None:
    pacer = Pacer(0.05, 0.0)
    pacer.change_pace("pause", 0.0)
    assert pacer.seconds_until_due(9.0) is None
    pacer.change_pace("step", 9.0)
    assert _run(pacer, 9.0, 1.0) == 1
    pacer.change_pace("pause", 10.0)
    assert _run(pacer, 10.0, 1.0) == 20


def test_a_single_step_while_running_pauses() -> None:
    pacer = Pacer(0.05, 0.0)
    pacer.change_pace("step", 0.0)
    assert pacer.paused
    assert pacer.seconds_until_due(1.0) is None


def test_lag_is_not_made_up_for() -> None:
    pacer = Pacer(0.05, 0.0)
    pacer.note_step(10.0)
    assert _run(pacer, 10.0, 1.0) <= 21


def test_what_a_benchmark_asks_for_is_kept(tmp_path: Path) -> None:
    pacer = Pacer(0.5, 10.0, keeps_times=True)
    for done in (10.25, 10.5, 11.5):
        pacer.note_step(done)
    pacer.save_times(str(tmp_path / "times.npy"))
    times = np.load(tmp_path / "times.npy")
    assert times.tolist() == [[10.25, 0.25], [10.5, 0.0], [11.5, 0.5]]
