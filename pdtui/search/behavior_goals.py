"""What a behavior is meant to reach, and the score by which candidates for it are compared."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.probing.effect_probe import PlanEffects
from pdtui.robots.robot import Robot
from pdtui.robots.robot_goals import BehaviorGoal

STANDING = 0.1
"""m/s; whoever is slower stands already."""
_QUANTILE = 0.2
_FALL = 2.0
_DOUBLING = 0.02


def reachable_goals(robot: Robot, unperturbed: Floats) -> tuple[BehaviorGoal, ...]:
    """The behaviors of a robot's goals whose attributes it has; no stop for one that stands.

    Args:
        robot: declares its goals.
        unperturbed: means of its attributes without stimulation, shape (K, J).
    """
    means = dict(zip((one.name for one in robot.attributes), unperturbed.mean(axis=0).tolist(), strict=True))
    return tuple(
        goal
        for goal in robot.goals.behaviors
        if goal.aim.attribute in means
        and (goal.aim.direction != "stop" or means[goal.aim.attribute] > STANDING)
    )


def goal_gains(goal: BehaviorGoal, column: int, result: PlanEffects) -> Floats:
    """How far each plan goes the goal's way from each start, shape (S, K).

    In the attribute's unit; for a stop, the share of the unperturbed mean that is gone. A roll-out that fell
    gains nothing, however far it was thrown.
    """
    if goal.aim.direction == "stop":
        unperturbed = result.unperturbed[:, column]
        gain = (np.abs(unperturbed) - np.abs(result.means[..., column])) / np.maximum(
            np.abs(unperturbed), 1e-9
        )
    else:
        gain = result.effects[..., column] * goal.aim.sign
    lost: Floats = np.where(result.falls | ~np.isfinite(gain), np.minimum(np.nan_to_num(gain), 0.0), gain)
    return lost


def goal_scores(goal: BehaviorGoal, column: int, result: PlanEffects, units: Sequence[int]) -> Floats:
    """Score of each plan, in parts of what is enough; 1 is a behavior that works, shape (S,).

    Halfway between the mean of the gains over the starts and their lower fifth, because a behavior has to
    work from any state, and a search has to see that it gets nearer; less twice the share of falls, and a
    little for every doubling of the units.

    Args:
        goal: what is aimed at.
        column: of the goal's attribute.
        result: the plans, probed.
        units: how many units each plan overwrites.
    """
    gain = goal_gains(goal, column, result)
    sure = 0.5 * (gain.mean(axis=1) + np.quantile(gain, _QUANTILE, axis=1)) / goal.enough
    doublings = np.log2(np.maximum(np.array(units, np.float64), 1.0))
    value: Floats = sure - _FALL * result.falls.mean(axis=1) - _DOUBLING * doublings
    return value
