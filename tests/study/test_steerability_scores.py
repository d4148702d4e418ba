"""The score of walking and steering: by hand, on data whose effects are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pdtui.study.matching.steerability_scores import describe_best_and_shipped, score_rows, score_steerability
from pdtui.study.matching.study_data import (
    ROLES,
    SHIPPED_STUDY_DATA,
    MatchingStudyData,
    MeasuredUnits,
    PolicyFacts,
    read_study_data,
)
from tests.study.planted_study import small_plan

NAMES = [f"walker-ppo-tanh-256x256-{seed}" for seed in (1000, 1001, 1002)]


def _facts(name: str, speed: float, failures: float = 0.0, walks: bool = True) -> PolicyFacts:
    return PolicyFacts(name, "walker", "none", "trained", "0", 100.0, speed, failures, walks)


def _measured(
    policy: str, attribute: str, effects: list[list[list[float]]], roles: list[str]
) -> MeasuredUnits:
    """Return units with these effects, of shape (groups, values, units)."""
    count = len(roles)
    return MeasuredUnits(
        policy,
        attribute,
        np.arange(count, dtype=np.uint16),
        np.array([ROLES.index(role) for role in roles], np.uint8),
        np.array(effects),
        np.zeros((2, count), np.uint16),
        np.zeros((2, count)),
    )


@pytest.fixture
def data() -> MatchingStudyData:
    roles = ["reference", "random", "matched"]
    vx = [
        # On the choosing start, the random unit raises it most, the reference unit lowers it most.
        [[-0.9, 0.0, 5.0], [0.3, 0.8, 5.0]],
        [[-0.6, 0.0, 5.0], [2.0, 0.5, 5.0]],
        [[-1.8, 0.0, 5.0], [2.0, -0.1, 5.0]],
    ]
    torque = [[[9.0] * 3] * 2] * 3
    return MatchingStudyData(
        small_plan(),
        (_facts(NAMES[0], 3.0, 0.25), _facts(NAMES[1], 4.0), _facts(NAMES[2], 1.0, 1.0, False)),
        (
            _measured(NAMES[0], "vx", vx, roles),
            _measured(NAMES[0], "right hip torque", torque, roles),
            _measured(
                NAMES[1],
                "vx",
                [[[0.5] * 3, [-0.5] * 3], [[0.2] * 3, [-0.2] * 3], [[0.2] * 3, [0.0] * 3]],
                roles,
            ),
        ),
    )


def test_a_unit_is_chosen_on_one_start_and_judged_on_others(data: MatchingStudyData) -> None:
    scores = {one.policy.name: one for one in score_steerability(data)}
    first = scores[NAMES[0]]
    assert first.walking == pytest.approx(0.75 * 3.0 / 4.0)
    # Up: (0.5 - 0.1) / 2; down: 1.2, of which 1 counts. A matched unit cannot be chosen.
    assert first.steering == pytest.approx((0.2 + 1.0) / 2)
    assert first.halves == pytest.approx(((0.5 + 0.6) / 2, (0.0 + 1.0) / 2))
    assert first.attributes == {"vx": first.steering}
    assert scores[NAMES[1]].score == pytest.approx((0.2 + 0.1) / 2)
    assert scores[NAMES[2]].score == 0.0
    assert all(map(math.isnan, scores[NAMES[2]].halves))


def test_scores_are_in_order_and_say_which_is_shipped(data: MatchingStudyData) -> None:
    scores = score_steerability(data)
    assert [one.policy.name for one in scores] == NAMES
    shipped = [replace(one, policy=replace(one.policy, shipped=one.policy.seed == 1001)) for one in scores]
    assert describe_best_and_shipped(shipped) == (
        f"Of 3 policies of `walker`, `{NAMES[0]}` scores best, 0.34; the shipped one is number 2, with 0.15."
    )
    assert score_rows(shipped)[1][1] == "PPO (shipped)"
    assert score_rows(shipped)[2][-2:] == ("–", "0.00")
    assert "the shipped one was not measured" in describe_best_and_shipped(scores)


def test_a_robot_with_one_policy_is_not_scored(data: MatchingStudyData) -> None:
    assert score_steerability(replace(data, policies=data.policies[:1])) == ()


def test_the_shipped_data_score_policies_of_three_robots() -> None:
    scores = score_steerability(read_study_data(SHIPPED_STUDY_DATA))
    assert {one.policy.robot for one in scores} == {"walker", "ant", "bipedal_walker"}
    assert sum(one.policy.shipped for one in scores) == 3
    assert all(0.0 <= one.score <= 1.0 for one in scores)
