"""A step without a reward leads where a step with one does, to the last bit, until the episode is over."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.outcome import Outcome
from pdtui.robots import RobotSpec, make_robot


@pytest.mark.parametrize("name", ["ant", "walker", "bipedal_walker", "anymal"])
def test_both_steps_lead_to_the_same_state(name: str) -> None:
    rewarded, bare = make_robot(RobotSpec(name)), make_robot(RobotSpec(name))
    rng = np.random.default_rng(3)
    for robot in (rewarded, bare):
        robot.reset(seed=5)
    space, outcome = rewarded.action_space, None
    for _ in range(400):
        action = rng.uniform(-1, 1, space.shape or ()).astype(np.float32)
        observation, _, terminated, truncated, info = rewarded.step(action)
        seen, outcome, ends = bare.step_without_reward(action)
        np.testing.assert_array_equal(seen, observation)
        np.testing.assert_array_equal(bare.read_attributes(), rewarded.read_attributes())
        assert bare.digest() == rewarded.digest()
        assert ends == (terminated or truncated)
        assert outcome == rewarded.outcome_of(terminated, truncated, info)
        if ends:
            break
    if name != "anymal":  # random actions do not fell it
        assert outcome is Outcome.FELL
