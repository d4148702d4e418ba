"""Getting off a tree: only where one holds the robot, the sooner way, and the other one after a while."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Floats
from pdtui.paper.forest.scripted_operator import STUCK_TIME, StuckAtTreeSteering

DT = 0.016
TREE = np.array([[5.0, 0.0, 0.3]])


def _standing(x: float, y: float, heading: float, steps: int = 60) -> Floats:
    return np.tile([x, y, heading], (steps, 1))


@pytest.mark.parametrize(("y", "side"), [(0.1, 1), (-0.1, -1)])
def test_it_turns_to_the_side_on_which_the_robot_is(y: float, side: int) -> None:
    assert StuckAtTreeSteering(DT).choose_turn(_standing(4.45, y, 0.0), TREE, 0.0, False) == side


def test_it_keeps_out_where_no_tree_holds_the_robot() -> None:
    moving = np.column_stack([np.linspace(3.0, 4.45, 60), np.full(60, 0.1), np.zeros(60)])
    assert StuckAtTreeSteering(DT).choose_turn(moving, TREE, 0.0, False) == 0
    assert StuckAtTreeSteering(DT).choose_turn(_standing(2.0, 0.1, 0.0), TREE, 0.0, False) == 0
    assert StuckAtTreeSteering(DT).choose_turn(_standing(4.45, 0.1, 3.0), TREE, 3.0, False) == 0
    assert StuckAtTreeSteering(DT).choose_turn(_standing(4.45, 0.1, 0.0), TREE, 0.0, True) == 0
    assert (
        StuckAtTreeSteering(DT).choose_turn(
            _standing(4.45, 0.1, 0.0, round(STUCK_TIME / DT)), TREE, 0.0, False
        )
        == 0
    )
    assert StuckAtTreeSteering(DT).choose_turn(_standing(4.45, 0.1, 0.0), TREE[:0], 0.0, False) == 0


def test_it_turns_until_the_tree_is_aside() -> None:
    escape = StuckAtTreeSteering(DT)
    assert [escape.choose_turn(_standing(4.45, 0.1, h), TREE, h, False) for h in (0.0, 0.5, 1.0, 1.4)] == [
        1,
        1,
        1,
        0,
    ]


def test_where_that_does_not_help_it_tries_the_other_way() -> None:
    escape = StuckAtTreeSteering(DT)
    turns = [
        escape.choose_turn(_standing(4.45, 0.1, 0.0, steps), TREE, 0.0, False) for steps in range(60, 320, 5)
    ]
    changes = np.flatnonzero(np.diff(turns))
    assert (turns[0], set(turns), len(changes)) == (1, {1, -1}, 2)
