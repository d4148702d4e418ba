"""The operator's reaction time and judgment: what it saw a moment ago, carried on to now."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pdtui.evaluation.protocol_settings import RandomPurpose, purpose_generator
from pdtui.paper.driving.road_sight import RoadSight

REACTION_TIME = 0.3
"""Age of what the operator sees when it acts, s."""
_SWING_KEPT = 0.6
"""Share of a turn that goes on meanwhile: a policy weaves."""
_DISTANCE_SPREAD, _SPEED_SPREAD, _PATIENCE_SPREAD = 0.05, 0.1, 0.1


@dataclass(frozen=True)
class JudgmentErrors:
    """How one operator judges: factors on the true values, 1 if it judges right.

    Attributes:
        distance: Factor on distances ahead.
        speed: Factor on the speeds of others.
        patience: Factor on the times before which it acts.
    """

    distance: float = 1.0
    speed: float = 1.0
    patience: float = 1.0


def sample_judgment_errors(repeat: int, scene: int) -> JudgmentErrors:
    """Return the judgment of the operator of a repeat in a scene.

    Nobody judges distances and speeds exactly, nor twice alike; the standard deviations are 5 % of distances
    and 10 % of speeds and times.
    """
    rng = purpose_generator(RandomPurpose.OPERATOR_JUDGMENT, repeat, scene)
    spreads = np.array([_DISTANCE_SPREAD, _SPEED_SPREAD, _PATIENCE_SPREAD])
    return JudgmentErrors(*(1.0 + spreads * np.clip(rng.standard_normal(3), -2.0, 2.0)).tolist())


class OperatorMemory:
    """Keeps what was seen until the reaction time is over.

    Args:
        dt: Duration of a control step, s.
        judgment: How the operator judges what it sees.
    """

    def __init__(self, dt: float, judgment: JudgmentErrors) -> None:
        self._dt, self._judgment = dt, judgment
        self._delay = math.ceil(REACTION_TIME / dt - 1e-9)
        self._seen: list[RoadSight] = []

    def recall(self, sight: RoadSight) -> RoadSight | None:
        """Keep what is seen now, and return what was seen a reaction time ago as it should be by now.

        None as long as nothing was seen that long ago. Call it once per control step.
        """
        self._seen = [*self._seen[-self._delay :], sight]
        if len(self._seen) <= self._delay:
            return None
        return self._carry_on(self._seen[0])

    def _carry_on(self, seen: RoadSight) -> RoadSight:
        time = self._delay * self._dt
        turned = _SWING_KEPT * seen.swing * time
        direction = seen.heading + turned / 2
        ahead, aside = seen.speed * math.cos(direction) * time, seen.speed * math.sin(direction) * time
        others = seen.others.copy()
        place = seen.line.points_at(np.array([seen.along]))
        others[:, :2] = place + (others[:, :2] - place) * self._judgment.distance
        others[:, 5] *= self._judgment.speed
        return replace(
            seen,
            along=seen.along + ahead,
            beside=seen.beside + aside,
            heading=seen.heading + turned,
            left=seen.left - aside,
            right=seen.right + aside,
            others=others,
            age=time,
        )
