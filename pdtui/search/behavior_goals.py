"""What a behavior is meant to reach, and the score by which candidates for it are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Attribute, BehaviorAim, Floats
from pdtui.probing.effect_probe import PlanEffects


@dataclass(frozen=True)
class BehaviorGoal:
    """One behavior to look for.

    Attributes:
        name: of the behavior.
        key: that latches it.
        says: one sentence on what one sees.
        aim: the attribute and where it is to go.
        enough: effect that counts as reached: in the attribute's unit, or for a stop the share of its mean
            that goes.
    """

    name: str
    key: str
    says: str
    aim: BehaviorAim
    enough: float


# Targets for a walker of the Ant's speed; a robot without an attribute goes without its behaviors.
GOALS: tuple[BehaviorGoal, ...] = (
    BehaviorGoal("stop", "x", "stops and stands", BehaviorAim("speed", "stop"), 0.8),
    BehaviorGoal("up", "w", "walks on and drifts to +y", BehaviorAim("vy", "increase"), 0.7),
    BehaviorGoal("down", "s", "walks on and drifts to −y", BehaviorAim("vy", "decrease"), 0.7),
    BehaviorGoal(
        "spin left", "a", "turns left on the spot, or nearly", BehaviorAim("yaw rate", "increase"), 0.5
    ),
    BehaviorGoal(
        "spin right", "d", "turns right on the spot, or nearly", BehaviorAim("yaw rate", "decrease"), 0.5
    ),
)
STANDING = 0.1
"""m/s; whoever is slower stands already."""
_QUANTILE = 0.2
_FALL = 2.0
_DOUBLING = 0.02


def goals_for(attributes: Sequence[Attribute], unperturbed: Floats) -> tuple[BehaviorGoal, ...]:
    """The goals whose attributes a robot has; no stop for one that stands.

    Args:
        attributes: of the robot.
        unperturbed: their means without stimulation, shape (K, J).
    """
    means = dict(zip((one.name for one in attributes), unperturbed.mean(axis=0).tolist(), strict=True))
    return tuple(
        goal
        for goal in GOALS
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
