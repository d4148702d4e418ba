"""Worlds that step elsewhere, beside the same worlds in this process."""

from __future__ import annotations

import numpy as np

from pdtui.training.robot_batch import RobotBatch


def check_worlds_are_the_same(here: RobotBatch, there: RobotBatch) -> None:
    """Step Ants in both with the same random actions, bit for bit, and go on from a state kept half-way."""
    drawn = np.random.default_rng(0).uniform(-1, 1, (12, len(here.observations), 8))
    actions = drawn.astype(np.float32)
    for action in actions[:6]:
        for mine, theirs in zip(here.step(action), there.step(action), strict=True):
            np.testing.assert_array_equal(mine, theirs)
    kept = there.state()
    first = [there.step(action) for action in actions[6:]]
    there.restore(kept)
    for action, expected in zip(actions[6:], first, strict=True):
        for again, rows, local in zip(there.step(action), expected, here.step(action), strict=True):
            np.testing.assert_array_equal(again, rows)
            np.testing.assert_array_equal(local, rows)
    np.testing.assert_array_equal(here.observations, there.observations)
