"""Whether a run is what a person would call it."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import AimDirection, Attribute, BehaviorAim
from pdtui.core.outcome import Outcome, is_failure
from pdtui.evaluation.behavior_criteria import JudgedRun, choose_criterion
from pdtui.evaluation.held_run import HeldRunTrace
from pdtui.evaluation.protocol_settings import RunTimes

TIMES = RunTimes(press=100, held=1000, after=100, window=100, bin=5, dt=0.05)
ATTRIBUTES = (
    Attribute("vx", "m/s"),
    Attribute("vy", "m/s"),
    Attribute("speed", "m/s"),
    Attribute("yaw", "rad", wraps=True),
    Attribute("yaw rate", "rad/s"),
    Attribute("height", "m"),
)


def _run(
    *,
    vx: float = 0.0,
    vy: float = 0.0,
    turn: float = 0.0,
    turns_for: float = 99.0,
    ended_at: int | None = None,
    outcome: Outcome = Outcome.FELL,
) -> HeldRunTrace:
    """A run at a constant velocity that turns for a while."""
    seconds = (np.arange(TIMES.bins) + 0.5) * TIMES.bin_seconds
    rate = np.where(seconds < turns_for, turn, 0.0)
    yaw = turn * np.minimum(seconds, turns_for)
    ones = np.ones(TIMES.bins)
    values = np.column_stack([vx * ones, vy * ones, np.hypot(vx, vy) * ones, yaw, rate, 0.6 * ones])
    places = np.column_stack([vx * seconds, vy * seconds])
    return HeldRunTrace(values, places, None if ended_at is None else outcome, ended_at)


def _met(name: str, attribute: str, direction: AimDirection, run: HeldRunTrace) -> bool:
    criterion = choose_criterion(name, BehaviorAim(attribute, direction), ATTRIBUTES)
    return criterion.is_met(JudgedRun(run, _run(vx=4.0), TIMES, ATTRIBUTES))


def test_a_spin_is_two_full_turns_and_need_not_last() -> None:
    assert _met("spin left", "yaw rate", "increase", _run(turn=0.6, turns_for=22.0))
    assert not _met("spin left", "yaw rate", "increase", _run(turn=0.6, turns_for=20.0))
    assert not _met("spin right", "yaw rate", "decrease", _run(turn=0.6))
    assert not _met("spin left", "yaw rate", "increase", _run(turn=0.6, ended_at=999))
    assert _met("spin left", "yaw rate", "increase", _run(turn=0.6, ended_at=1000))
    for outcome in Outcome:
        ended = _run(turn=0.6, ended_at=999, outcome=outcome)
        assert _met("spin left", "yaw rate", "increase", ended) == (not is_failure(outcome))


def test_left_is_a_heading_that_goes_on_turning() -> None:
    assert _met("left", "yaw rate", "increase", _run(turn=0.2))
    assert not _met("left", "yaw rate", "increase", _run(turn=0.6, turns_for=44.0))
    assert not _met("left", "yaw rate", "increase", _run(turn=0.1))
    assert _met("right", "yaw rate", "decrease", _run(turn=-0.2))
    assert not _met("right", "yaw rate", "decrease", _run(turn=0.2))


def test_stop_is_standing_without_drifting() -> None:
    assert _met("stop", "speed", "stop", _run(vx=0.04))
    assert not _met("stop", "speed", "stop", _run(vx=0.06))  # 0.3 m in 5 s
    assert not _met("stop", "speed", "stop", _run(vx=0.5))
    still = _run()
    no_poses = HeldRunTrace(still.values, np.full((TIMES.bins, 2), np.nan), None)
    assert _met("stop", "speed", "stop", no_poses)


def test_up_is_a_course_and_a_drift_is_a_sign() -> None:
    assert _met("up", "vy", "increase", _run(vx=1.9, vy=2.0))
    assert not _met("up", "vy", "increase", _run(vx=3.8, vy=2.6))
    assert _met("drift up", "vy", "increase", _run(vx=3.8, vy=2.6))
    assert not _met("down", "vy", "decrease", _run(vx=0.1, vy=2.0))


@pytest.mark.parametrize(("direction", "met"), [("raise", False), ("lower", True)])
def test_more_and_less_are_compared_with_the_default(direction: AimDirection, met: bool) -> None:
    assert _met("anything", "speed", direction, _run(vx=3.0)) == met


def test_criteria_are_in_words() -> None:
    def words(name: str, attribute: str, direction: AimDirection) -> str:
        return choose_criterion(name, BehaviorAim(attribute, direction), ATTRIBUTES).words

    assert words("spin left", "yaw rate", "increase") == "two full turns to the left"
    assert words("stop", "speed", "stop") == "stands in the last 5 s: under 0.1 m/s, within 0.25 m"
    assert words("down", "vy", "decrease") == "course within 45° of −y in the last 5 s"
    assert words("slow", "speed", "lower") == "speed < the default's in the last 5 s"
