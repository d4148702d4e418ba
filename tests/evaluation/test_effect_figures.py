"""Figures over time, on runs that were made up."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Attribute, BehaviorAim, Floats
from pdtui.core.outcome import Outcome
from pdtui.evaluation.effect_figures import (
    count_back_to_gait,
    measure_side_effects,
    onset_and_end,
    relative_spread,
    wanted_sign,
    window_effect,
)
from pdtui.evaluation.held_run import HeldRunTrace
from pdtui.evaluation.protocol_settings import ProtocolSettings, RunTimes, plan_run_times

TIMES = RunTimes(press=100, held=1000, after=100, window=100, bin=5, dt=0.05)
ATTRIBUTES = (Attribute("speed", "m/s"), Attribute("yaw", "rad", wraps=True), Attribute("height", "m"))


def _trace(speed: Floats, ended_at: int | None = None) -> HeldRunTrace:
    bins = np.arange(TIMES.bins)
    values = np.column_stack([speed, 0.1 * bins, 0.6 + 0.01 * np.sin(bins)])
    if ended_at is not None:
        values[max(0, ended_at // TIMES.bin) :] = np.nan
    return HeldRunTrace(
        values, np.zeros((TIMES.bins, 2)), None if ended_at is None else Outcome.FELL, ended_at
    )


def _step(effect: float, start: float, end: float) -> Floats:
    seconds = (np.arange(TIMES.bins) + 0.5) * TIMES.bin_seconds
    return np.where((seconds > start) & (seconds < end), effect, 0.0)


def test_the_press_is_drawn_for_each_seed_over_the_gait_and_the_hold_is_long() -> None:
    settings = ProtocolSettings()
    presses = [plan_run_times(settings, seed, 0.05).press for seed in range(300)]
    assert min(presses) >= 100
    assert max(presses) <= 199
    assert len(set(presses)) > 80
    assert presses[:20] == [plan_run_times(settings, seed, 0.008).press for seed in range(20)]
    for dt in (0.05, 0.02, 0.016, 0.008):
        times = plan_run_times(settings, 1, dt)
        assert times.held >= max(1000, 10.0 / dt)
        assert times.window * dt >= 5.0
        assert times.held % times.bin == times.after % times.bin == 0
        assert times.first_bins.stop <= times.last_bins.start
    flick = plan_run_times(settings, 1, 0.02, period=1.6)
    assert flick.held == 84  # 1.6 s, rounded up to bins of 0.24 s
    assert flick.after >= 1000


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_effect_that_comes_late_and_ends_early_is_timed(sign: float) -> None:
    onset, end = onset_and_end(sign * _step(0.6, 1.0, 30.0), TIMES, sign)
    assert onset == pytest.approx(1.0, abs=0.3)
    assert end == pytest.approx(30.0, abs=0.6)
    assert onset_and_end(sign * _step(0.6, 0.0, 99.0), TIMES, sign) == (0.25, 50.0)
    assert onset_and_end(sign * _step(0.6, 0.0, 99.0), TIMES, -sign)[1] == 0.0


def test_a_swinging_effect_lasts_although_single_bins_are_below_half() -> None:
    bins = np.arange(TIMES.bins)
    assert onset_and_end(1.0 + 1.5 * np.sin(2 * np.pi * bins / 4), TIMES, 1.0)[1] == 50.0


def test_windows_compare_the_same_seeds_and_a_fall_counts_as_no_effect() -> None:
    usual = [_trace(np.full(TIMES.bins, 4.0 + seed)) for seed in range(4)]
    slowed = [_trace(4.0 + seed - _step(3.0, 0.0, 30.0)) for seed in range(4)]
    first, last = (window_effect(slowed, usual, 0, part) for part in (TIMES.first_bins, TIMES.last_bins))
    assert (first.effect, first.low, first.high) == (-3.0, -3.0, -3.0)
    assert first.value == pytest.approx(2.5)
    assert first.default == pytest.approx(5.5)
    assert first.p_value == 2 / 2**4
    assert (last.effect, last.p_value) == (0.0, 1.0)
    fallen = [_trace(np.full(TIMES.bins, 1.0), ended_at=0), *slowed[1:]]
    assert window_effect(fallen, usual, 0, TIMES.first_bins).effect == pytest.approx(-3.0 * 3 / 4)


def test_side_effects_are_in_standard_deviations_of_the_walk() -> None:
    walk = np.sin(np.arange(TIMES.bins))
    usual, moved = [_trace(5.0 + walk)] * 2, [_trace(4.0 + walk)] * 2
    side = measure_side_effects(moved, usual, ATTRIBUTES, 0, TIMES)
    assert side.wanted == pytest.approx(-1.0 / walk.std(), rel=0.01)
    assert (side.others, side.largest) == (0.0, "height")


def test_a_run_is_back_if_its_last_two_seconds_look_like_the_usual_gait() -> None:
    usual = [_trace(5.0 + 0.3 * np.sin(np.arange(TIMES.bins) + seed)) for seed in range(5)]
    slow = [_trace(np.full(TIMES.bins, 3.0)), _trace(np.full(TIMES.bins, 5.0), ended_at=1050)]
    assert count_back_to_gait(usual, usual, ATTRIBUTES, 0) == 5
    assert count_back_to_gait(slow, usual, ATTRIBUTES, 0) == 0


def test_stopping_is_wanted_towards_zero_and_seeds_that_hardly_differ_are_found() -> None:
    backward = [_trace(np.full(TIMES.bins, -4.0)), _trace(np.full(TIMES.bins, -4.02))]
    aim = BehaviorAim("speed", "stop")
    assert wanted_sign(aim, backward, 0) == 1.0
    assert wanted_sign(aim, [_trace(np.full(TIMES.bins, 4.0))], 0) == -1.0
    assert wanted_sign(BehaviorAim("speed", "lower"), backward, 0) == -1.0
    assert relative_spread(backward, 0, TIMES) == pytest.approx(0.00353, rel=0.01)
