"""Tuning finds gains that hold better, on seeds that it did not see, and leaves good ones alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdtui.core.errors import MapError
from pdtui.search.gain_tuning import TuningSettings, tune_gains
from pdtui.search.pid_gain_space import gains_from_point, point_from_gains, sample_gain_points
from pdtui.search.tracking_drives import TrackingDriveRunner
from pdtui.search.tracking_summary import choose_tracking_targets
from pdtui.stimulation.stimulation_map import PidGains
from tests.turning_robot import turning_loop

SMALL = TuningSettings(points=16, refinements=6)


def test_bad_gains_get_better_and_the_same_arguments_give_the_same_ones() -> None:
    (result,) = tune_gains(turning_loop(kp=0.3), ["hold heading"], range(2000, 2004), settings=SMALL)
    assert result.better
    assert result.after.error < 0.6 * result.before.error
    assert result.after.responses.unrisen < result.before.responses.unrisen
    assert result.after.seeds == (2002, 2003)
    assert result.after.falls == 0
    (again,) = tune_gains(turning_loop(kp=0.3), ["hold heading"], range(2000, 2004), settings=SMALL)
    assert again == result


def test_gains_that_make_it_fall_are_limited() -> None:
    (result,) = tune_gains(
        turning_loop(kp=20.0, limit=4.0), ["hold heading"], range(2000, 2004), settings=SMALL
    )
    assert result.before.falls == 2
    assert result.after.falls == 0
    assert result.better
    assert result.new.limit < 3.0


def test_what_is_no_better_is_not_taken() -> None:
    (once,) = tune_gains(turning_loop(), ["hold heading"], range(2000, 2004), settings=SMALL)
    loop = turning_loop(once.new.kp, once.new.limit)
    kept = TuningSettings(points=1, refinements=0)
    (result,) = tune_gains(loop, ["hold heading"], range(2000, 2004), settings=kept)
    assert not result.better
    assert "no better than the map's" in result.verdict


def test_what_is_no_angle_is_stepped_about_its_natural_value() -> None:
    loop = turning_loop()
    with TrackingDriveRunner(loop) as runner:
        targets = choose_tracking_targets(runner, loop.map.behaviors["hold pace"], [2000])
    assert targets == pytest.approx([1.0, 1.1, 1.2, 1.1, 1.0, 0.9, 0.8, 0.9, 1.0])
    (result,) = tune_gains(loop, ["hold pace"], range(2000, 2002), settings=SMALL)
    assert result.better
    assert result.after.unit == "m/s"


def test_a_search_without_time_ends_with_what_it_has() -> None:
    (result,) = tune_gains(
        turning_loop(), ["hold heading"], [2000, 2001], settings=TuningSettings(minutes=1e-9)
    )
    assert result.ended_early
    assert result.tried == 1
    assert result.new == result.old
    assert not result.better


def test_what_cannot_be_tuned_is_named() -> None:
    loop = turning_loop()
    with pytest.raises(MapError, match="test: no behavior 'spin'; of mode pid are: hold heading, hold pace"):
        tune_gains(loop, ["spin"], [2000, 2001])
    with pytest.raises(MapError, match="behavior 'turn': expected mode pid, found fixed"):
        tune_gains(loop, ["turn"], [2000, 2001])
    with pytest.raises(MapError, match="expected at least 2 seeds"):
        tune_gains(loop, [], [2000])


def test_points_stand_for_gains_and_back() -> None:
    old = PidGains("yaw", -2.0, 0.5, 0.1, 3.0, 0.1)
    points = sample_gain_points(32, 200)
    assert np.isnan(points[:, 2]).any()
    assert np.isfinite(points[:, 2]).any()
    for point in points:
        pid = gains_from_point(point, old, 0.7)
        assert pid.kp < 0 < pid.limit
        found = point_from_gains(pid, old, 0.7)
        assert found is not None
        np.testing.assert_allclose(found, point, atol=0.02)
    no_integral = gains_from_point([0.0, 0.0, math.nan, math.nan], old, 0.5)
    assert (no_integral.kp, no_integral.ki, no_integral.kd, no_integral.limit) == (-6.0, 0.0, 0.0, 3.0)
    assert point_from_gains(PidGains("yaw", 0.0, 1.0, 0.0, 1.0, 0.1), old, 0.5) is None
