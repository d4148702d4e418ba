"""The loop with policies that remember, see images or act by choice: events repeat it bit for bit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pdtui.core.drive_events import DriveEvent, group_events_by_step
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.robot import Robot
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap
from tests.small_worlds import Dot, Pole, dot_policy, pole_policy

EVENTS = (
    DriveEvent(15, "behavior", "push", key="w"),
    DriveEvent(25, "default", key="space"),
    DriveEvent(33, "rewind", value=20.0),
    DriveEvent(50, "reset"),
)


def _drive(robot: Robot, policy: Policy, unit: str, events: tuple[DriveEvent, ...]) -> list[StepRecord]:
    push = Behavior("push", "w", "pushes", {unit: 1.5})
    loop = ControlLoop(robot, policy, StimulationMap(robot.name, "", "", "space", {}, {"push": push}), 3)
    by_step = group_events_by_step(events)
    return [loop.advance(by_step.get(step, ())) for step in range(70)]


@pytest.mark.parametrize(
    ("robot", "policy", "unit"),
    [(Dot, dot_policy, "features.0:10"), (Dot, dot_policy, "fc:3"), (Pole, pole_policy, "lstm:7")],
)
def test_events_repeat_the_drive_with_rewind_and_reset(
    robot: Callable[[], Robot], policy: Callable[[], Policy], unit: str
) -> None:
    first, used = _drive(robot(), policy(), unit, EVENTS), policy()
    _drive(robot(), used, unit, ())
    again = _drive(robot(), used, unit, EVENTS)
    assert [record.digest for record in again] == [record.digest for record in first]
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.activations, other.activations)
    (flat,) = first[20].stimulation.units
    assert first[20].activations[flat] == 1.5


def test_a_rewind_brings_the_memory_back_with_the_world() -> None:
    plain = _drive(Pole(), pole_policy(), "lstm:7", ())
    rewound = _drive(Pole(), pole_policy(), "lstm:7", (DriveEvent(33, "rewind", value=20.0),))
    for before, after in zip(plain[20:57], rewound[33:], strict=True):
        np.testing.assert_array_equal(before.activations, after.activations)
        assert before.digest == after.digest


def test_an_episode_begins_without_memory() -> None:
    records = _drive(Pole(), pole_policy(), "lstm:7", (DriveEvent(50, "reset"),))
    policy = pole_policy()
    robot = Pole()
    robot.reset(seed=3)
    observation, _ = robot.reset()
    np.testing.assert_array_equal(records[50].activations, policy.act(observation).activations)
