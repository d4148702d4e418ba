"""The judges of Cassie's tasks, on made-up runs."""

from __future__ import annotations

import numpy as np
import pytest
from pdtui.robots.cassie_tasks import judge_back_flip, judge_cassie_jump, judge_crouch, judge_tiptoe

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.outcome import Outcome
from pdtui.robots.task import TaskRunTrace

NAMES = (
    "forward",
    "height",
    "left contact",
    "right contact",
    "left foot height",
    "right foot height",
    "pelvis pitch",
)
ATTRIBUTES = tuple(Attribute(name, "") for name in NAMES)
WALK = (1.0, 0.9, 1.0, 0.0, 0.03, 0.2, 0.0)


def _trace(steps: int, outcome: Outcome | None = None, /, **changes: Floats | float) -> TaskRunTrace:
    values = np.tile(WALK, (steps, 1))
    for name, value in changes.items():
        values[:, NAMES.index(name.replace("_", " "))] = value
    return TaskRunTrace(ATTRIBUTES, np.tile(WALK, (60, 1)), values, outcome)


@pytest.mark.parametrize(("height", "crouches", "on_tiptoe"), [(0.5, True, False), (1.0, False, True)])
def test_a_height_counts_only_while_it_walks_on(height: float, crouches: bool, on_tiptoe: bool) -> None:
    assert judge_crouch(_trace(250, height=height)).success == crouches
    assert judge_tiptoe(_trace(250, height=height)).success == on_tiptoe
    assert not judge_crouch(_trace(250, height=height, forward=0.2)).success
    assert not judge_tiptoe(_trace(200, Outcome.FELL, height=height)).success


def test_lower_is_a_better_crouch() -> None:
    scores = [judge_crouch(_trace(250, height=height)).score for height in (0.9, 0.8, 0.6)]
    assert scores == sorted(scores)
    assert scores[0] < scores[-1]


def _jump(airborne: int, height: float, steps: int = 200) -> dict[str, Floats]:
    off, up = np.ones(steps), np.full(steps, 0.03)
    off[50 : 50 + airborne], up[50 : 50 + airborne] = 0.0, height
    return {"left_contact": off, "right_contact": off, "left_foot_height": up, "right_foot_height": up}


@pytest.mark.parametrize(
    ("airborne", "height", "done"), [(13, 0.16, True), (12, 0.16, False), (13, 0.14, False)]
)
def test_a_jump_takes_both_feet_off_the_ground_for_long_and_high(
    airborne: int, height: float, done: bool
) -> None:
    assert judge_cassie_jump(_trace(200, **_jump(airborne, height))).success == done
    assert not judge_cassie_jump(_trace(150, Outcome.FELL, **_jump(airborne, height, 150))).success


def test_a_flip_turns_backward_and_lands() -> None:
    turn = np.linspace(0.0, -2 * np.pi, 200)
    verdict = judge_back_flip(_trace(200, pelvis_pitch=turn))
    assert verdict.success
    assert verdict.figures["turned (degrees)"] == pytest.approx(360.0)
    assert not judge_back_flip(_trace(200, pelvis_pitch=-turn)).success
    assert not judge_back_flip(_trace(150, Outcome.FELL, pelvis_pitch=turn[:150] * 4 / 3)).success
