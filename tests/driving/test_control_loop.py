"""The control loop: a function of robot, policy, map, seed and events."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from pdtui.core.drive_events import DriveEvent, group_events_by_step
from pdtui.core.errors import KeystrokeError
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import StimulationMap


def _loop(policy: Policy, small_map: StimulationMap, seed: int = 3, **options: Any) -> ControlLoop:
    return ControlLoop(make_robot("ant"), policy, small_map, seed, **options)


def _drive(loop: ControlLoop, steps: int, events: Iterable[DriveEvent] = ()) -> list[StepRecord]:
    by_step = group_events_by_step(events)
    return [loop.advance(by_step.get(step, ())) for step in range(loop.step, loop.step + steps)]


EVENTS = (
    DriveEvent(20, "behavior", "push", key="w"),
    DriveEvent(20, "behavior", "twitch", key="t"),
    DriveEvent(40, "default", key="space"),
    DriveEvent(50, "behavior", "hold heading", key="h"),
    DriveEvent(55, "target", "hold heading", 0.4, key="left"),
    DriveEvent(80, "rewind", value=30.0, key="backspace"),
    DriveEvent(90, "reset", key="r"),
)


@pytest.mark.parametrize("stochastic", [False, True])
def test_the_same_events_give_the_same_bits(
    policy: Policy, small_map: StimulationMap, stochastic: bool
) -> None:
    runs = [_drive(_loop(policy, small_map, stochastic=stochastic), 120, EVENTS) for _ in range(2)]
    assert [record.digest for record in runs[0]] == [record.digest for record in runs[1]]
    other = _drive(_loop(policy, small_map, seed=4, stochastic=stochastic), 120, EVENTS)
    assert [record.digest for record in other] != [record.digest for record in runs[0]]


def test_without_events_the_loop_is_policy_and_robot(policy: Policy, small_map: StimulationMap) -> None:
    robot = make_robot("ant")
    observation, _ = robot.reset(seed=3)
    digests = []
    for _ in range(60):
        observation, *_ = robot.step(policy.act(observation).action)
        digests.append(robot.digest())
    assert [record.digest for record in _drive(_loop(policy, small_map), 60)] == digests


def test_an_event_acts_in_the_step_that_it_is_stamped_with(policy: Policy, small_map: StimulationMap) -> None:
    plain = _drive(_loop(policy, small_map), 25)
    pushed = _drive(_loop(policy, small_map), 25, EVENTS[:1])
    for before, after in zip(plain[:20], pushed[:20], strict=True):
        assert before.digest == after.digest
    assert pushed[20].stimulation.units == (3, 23)
    assert pushed[20].activations[3] == -2.0
    assert pushed[20].natural[0] == pytest.approx(plain[20].activations[3])
    assert plain[20].digest != pushed[20].digest


def test_a_rewind_restores_the_state_before_that_step(policy: Policy, small_map: StimulationMap) -> None:
    loop = _loop(policy, small_map)
    first = _drive(loop, 60)
    again = _drive(loop, 20, [DriveEvent(60, "rewind", value=30.0)])
    assert [record.digest for record in again] == [record.digest for record in first[30:50]]
    with pytest.raises(KeystrokeError, match="cannot rewind to step 33; kept steps: every 10th of 0..80"):
        loop.advance([DriveEvent(80, "rewind", value=33.0)])


def test_a_fall_starts_the_next_episode_and_clears_the_behaviors(
    policy: Policy, small_map: StimulationMap
) -> None:
    loop = _loop(policy, small_map)
    _drive(loop, 5, [DriveEvent(2, "behavior", "push")])
    robot = loop.robot
    qpos = robot.data.qpos.copy()  # type: ignore[attr-defined]
    qpos[3:7] = 0, 1, 0, 0
    robot.set_state(qpos, np.zeros(14))  # type: ignore[attr-defined]
    fallen = loop.advance()
    assert (fallen.ended, fallen.outcome) == ("fell: on its back", Outcome.FELL)
    following = loop.advance()
    assert (fallen.episode, following.episode) == (0, 1)
    assert following.behaviors == ()
    assert following.attributes[robot.attribute_index("height")] > 0.5


def test_a_divergence_leaves_a_record(policy: Policy, small_map: StimulationMap) -> None:
    loop = _loop(policy, small_map)
    loop.advance()
    loop.robot.data.qvel[:] = 1e9  # type: ignore[attr-defined]
    records = _drive(loop, 1)
    while records[-1].outcome is not Outcome.DIVERGED:
        records += _drive(loop, 1)
        assert len(records) < 20
    assert "the simulation diverged" in records[-1].ended
    assert np.isfinite(records[-1].attributes).all()


def test_an_event_of_another_step_is_refused(policy: Policy, small_map: StimulationMap) -> None:
    with pytest.raises(KeystrokeError, match="event for step 7 given to step 0"):
        _loop(policy, small_map).advance([DriveEvent(7, "default")])
