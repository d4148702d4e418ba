"""Which goals a robot can reach, and the score by which stimulations are compared for a goal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.probing.measured_effects import PlanEffects
from pdtui.robots.robot import Robot
from pdtui.robots.robot_goals import BehaviorGoal

STANDING = 0.1
"""Speed up to which a robot counts as standing, m/s."""
_QUANTILE = 0.2
_FALL_PENALTY = 2.0
_DOUBLING_PENALTY = 0.02
"""Penalty for each doubling of the units: it decides between plans that are otherwise as good."""


def reachable_goals(robot: Robot, unperturbed: Floats) -> tuple[BehaviorGoal, ...]:
    """Return the behavior goals whose attributes a robot has, without the stop if the robot stands.

    Args:
        robot: the robot, which declares its goals.
        unperturbed: means of the attributes without stimulation, shape (K, J).
    """
    means = dict(zip((one.name for one in robot.attributes), unperturbed.mean(axis=0).tolist(), strict=True))
    return tuple(
        goal
        for goal in robot.goals.behaviors
        if goal.aim.attribute in means
        and (goal.aim.direction != "stop" or means[goal.aim.attribute] > STANDING)
    )


def measure_goal_gains(goal: BehaviorGoal, column: int, result: PlanEffects) -> Floats:
    """Return how far each plan moves the attribute towards the goal from each start, shape (S, K).

    The gain is in the attribute's unit; for a stop it is the share by which the mean shrinks. A roll-out that
    ends in a fall gains nothing.
    """
    if goal.aim.direction == "stop":
        unperturbed = result.unperturbed[:, column]
        gain = (np.abs(unperturbed) - np.abs(result.means[..., column])) / np.maximum(
            np.abs(unperturbed), 1e-9
        )
    else:
        gain = result.effects[..., column] * goal.aim.sign
    gains: Floats = np.where(result.falls | ~np.isfinite(gain), np.minimum(np.nan_to_num(gain), 0.0), gain)
    return gains


def score_plans_by_goal(goal: BehaviorGoal, column: int, result: PlanEffects, units: Sequence[int]) -> Floats:
    """Return the score of each plan in multiples of the gain that is enough, shape (S,).

    The score is the average of the gains' mean and lower quintile over the starts: a behavior has to work
    from any state, but a search also has to see progress. Twice the share of falls and a little for every
    doubling of the units are subtracted.

    Args:
        goal: the goal.
        column: column of the goal's attribute.
        result: measured effects of the plans.
        units: number of units that each plan overwrites.
    """
    gain = measure_goal_gains(goal, column, result)
    sure = 0.5 * (gain.mean(axis=1) + np.quantile(gain, _QUANTILE, axis=1)) / goal.enough
    doublings = np.log2(np.maximum(np.array(units, np.float64), 1.0))
    penalties = _FALL_PENALTY * result.falls.mean(axis=1) + _DOUBLING_PENALTY * doublings
    scores: Floats = sure - penalties
    return scores
