"""Tuning finds gains that hold better, on seeds that it did not see, and leaves good ones alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.errors import MapError
from pdtui.core.outcome import Outcome
from pdtui.driving.control_loop import ControlLoop
from pdtui.search.gains.gain_search import (
    TuningSettings,
    gains_from_point,
    point_from_gains,
    sample_gain_points,
)
from pdtui.search.gains.gain_tuning import ANGLE_STEPS, FARTHEST_ANGLE, sample_angle_targets, tune_gains
from pdtui.search.gains.tracking_drives import TrackingDriveRunner
from pdtui.search.gains.tracking_summary import choose_tracking_targets
from pdtui.stimulation.stimulation_map import PidGains
from tests.turning_robot import turning_loop

SMALL = TuningSettings(points=10, refinements=4)
SEEDS = range(2000, 2004)


def replace_gains_of(loop: ControlLoop, pid: PidGains) -> ControlLoop:
    behaviors = dict(loop.map.behaviors)
    behaviors["hold heading"] = replace(behaviors["hold heading"], pid=pid)
    return ControlLoop(loop.robot, loop.policy, replace(loop.map, behaviors=behaviors), 0)


def test_bad_gains_get_better_and_the_same_arguments_give_the_same_ones() -> None:
    (result,) = tune_gains(turning_loop(kp=0.3), ["hold heading"], SEEDS, settings=SMALL)
    before, after = result.trials["map"], result.trials["found"]
    assert result.better
    assert after.tracking.error < 0.6 * before.tracking.error
    assert after.tracking.responses.unrisen < before.tracking.responses.unrisen
    assert {trial.tracking.seeds for trial in result.trials.values()} == {(2002, 2003)}
    assert after.tracking.outcomes == {Outcome.FELL: 0}
    assert before.ratio is not None
    assert before.ratio.value == pytest.approx(before.tracking.error / after.tracking.error)
    (again,) = tune_gains(turning_loop(kp=0.3), ["hold heading"], SEEDS, settings=SMALL)
    assert again == result
    plain = result.trials["proportional"].pid
    assert plain.ki == plain.kd == 0.0
    errors = {name: trial.tracking.error for name, trial in result.trials.items()}
    assert errors["proportional"] < 0.5 * errors["map"]
    assert errors[result.kept] == min(errors.values())
    assert result.gains == result.trials[result.kept].pid


def test_where_a_proportional_controller_wins_it_is_kept_and_the_verdict_says_so() -> None:
    windup = replace_gains_of(turning_loop(), PidGains("yaw", 6.0, 30.0, 0.0, 2.0, 0.1))
    (result,) = tune_gains(windup, ["hold heading"], SEEDS, settings=TuningSettings(points=1, refinements=0))
    assert (result.kept, result.gains.ki, result.gains.kd) == ("proportional", 0.0, 0.0)
    assert "Integral and derivative did not pay" in result.verdict


def test_gains_that_make_it_fall_are_limited() -> None:
    (result,) = tune_gains(turning_loop(kp=20.0, limit=4.0), ["hold heading"], SEEDS, settings=SMALL)
    assert result.trials["map"].tracking.outcomes == {Outcome.FELL: 2}
    assert result.trials[result.kept].tracking.outcomes == {Outcome.FELL: 0}
    assert result.better
    assert result.gains.limit < 3.0


def test_what_is_no_better_is_not_taken() -> None:
    good = replace_gains_of(turning_loop(), PidGains("yaw", 16.5, 0.0, 0.371, 2.4, 0.1))
    (result,) = tune_gains(good, ["hold heading"], SEEDS, settings=TuningSettings(points=1, refinements=0))
    assert not result.better
    assert result.gains == good.map.behaviors["hold heading"].pid
    assert "none is better than the map's" in result.verdict


def test_what_is_no_angle_is_stepped_about_its_natural_value() -> None:
    loop = turning_loop()
    with TrackingDriveRunner(loop) as runner:
        targets = choose_tracking_targets(runner, loop.map.behaviors["hold pace"], [2000])
    assert targets == pytest.approx([1.0, 1.1, 1.2, 1.1, 1.0, 0.9, 0.8, 0.9, 1.0])
    (result,) = tune_gains(loop, ["hold pace"], range(2000, 2002), settings=SMALL)
    assert result.better
    assert result.trials["found"].tracking.unit == "m/s"


def test_an_angle_is_stepped_otherwise_on_every_seed() -> None:
    drawn = [sample_angle_targets(seed) for seed in range(2000, 2020)]
    assert len(set(drawn)) == 20
    assert drawn[0] == sample_angle_targets(2000)
    steps = np.abs(np.diff(drawn))
    assert (np.abs(drawn) <= FARTHEST_ANGLE).all()
    assert (steps >= ANGLE_STEPS[0] - 0.01).all()
    assert (steps <= ANGLE_STEPS[1] + 0.01).all()


def test_a_search_without_time_ends_with_what_it_has() -> None:
    (result,) = tune_gains(
        turning_loop(), ["hold heading"], [2000, 2001], settings=TuningSettings(minutes=1e-9)
    )
    assert result.ended_early
    assert result.tried == 1
    assert result.gains == result.trials["map"].pid
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
    assert 0 < np.count_nonzero(points[:, 2]) < 32
    assert not sample_gain_points(32, 200, proportional=True)[:, 2:].any()
    for point in points:
        pid = gains_from_point(point, old, 0.7)
        assert pid.kp < 0 < pid.limit
        found = point_from_gains(pid, old, 0.7)
        assert found is not None
        np.testing.assert_allclose(found, point, atol=0.02)
    no_integral = gains_from_point([0.0, 0.0, 0.0, -0.3], old, 0.5)
    assert (no_integral.kp, no_integral.ki, no_integral.kd, no_integral.limit) == (-6.0, 0.0, 0.0, 3.0)
    assert point_from_gains(PidGains("yaw", 0.0, 1.0, 0.0, 1.0, 0.1), old, 0.5) is None
