"""What the car may do in the next seconds, and when it would come too close to something."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.paper.driving.road_sight import CAR_HALF_LENGTH, CAR_HALF_WIDTH, RoadSight

HORIZON = 4.0
"""How far a prediction reaches, s."""
TIMES: Floats = np.linspace(0.2, HORIZON, 20)
"""Its moments, s from now."""
STANDING = 0.5
"""Largest speed of something that counts as standing, m/s."""
_GAP_AHEAD, _GAP_ASIDE, _GAP_TO_EDGE = 1.5, 0.35, 0.7
"""Gaps that are too close, m: to others lengthways and sideways, and from the car's middle to an edge."""
_DRIFT_TIME = 0.6
"""Time in which a drift to one side ends, s."""


@dataclass(frozen=True, eq=False)
class Maneuver:
    """A way on from now.

    Attributes:
        name: Name of the key that begins it; empty to let the car go on.
        ahead, beside: Places along the road and to the left of here at `TIMES`, m, shape (T,) each.
        cost: What it costs to do it, in units of a key press.
    """

    name: str
    ahead: Floats
    beside: Floats
    cost: float = 0.0


@dataclass(frozen=True)
class TimesToConflict:
    """When a maneuver comes too close to something, s from now; infinite if it does not within `TIMES`.

    Attributes:
        standing: To something that stands.
        moving: To something that moves.
        edge: To an edge of the road.
    """

    standing: float
    moving: float
    edge: float

    @property
    def first(self) -> float:
        """The first of them."""
        return min(self.standing, self.moving, self.edge)


def drift(sight: RoadSight) -> Floats:
    """Return how far the car drifts to the left if nobody does anything, m, at `TIMES`."""
    return np.asarray(
        sight.speed * math.sin(sight.heading) * _DRIFT_TIME * (1.0 - np.exp(-TIMES / _DRIFT_TIME))
    )


def roll(speed: float, acceleration: float, top: float = math.inf) -> Floats:
    """Return how far a car gets, m, at `TIMES`; it neither rolls backwards nor gets faster than `top`."""
    times = np.concatenate([[0.0], TIMES])
    speeds = np.clip(speed + acceleration * times, 0.0, max(top, speed))
    return np.asarray(np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(times)))


def predict_times_to_conflict(sight: RoadSight, maneuver: Maneuver) -> TimesToConflict:
    """Return when a maneuver comes too close to what is seen, if everybody else keeps speed and direction."""
    out = (maneuver.beside > sight.left - _GAP_TO_EDGE) & (maneuver.beside > 0.1)
    out |= (maneuver.beside < _GAP_TO_EDGE - sight.right) & (maneuver.beside < -0.1)
    others = sight.others
    ahead, beside, half_length, half_width, speed, sideways = (column[:, None] for column in others.T)
    apart = ahead + speed * TIMES - maneuver.ahead
    aside = beside + sideways * TIMES - maneuver.beside
    close = np.abs(apart) < half_length + CAR_HALF_LENGTH + _GAP_AHEAD
    close &= np.abs(aside) < half_width + CAR_HALF_WIDTH + _GAP_ASIDE
    # Who comes from behind keeps away by himself.
    close &= (ahead > 0.0) | (np.abs(maneuver.beside[-1]) > 1.0)
    stands = np.hypot(others[:, 4], others[:, 5]) < STANDING
    return TimesToConflict(
        _first_time(close[stands].any(axis=0)), _first_time(close[~stands].any(axis=0)), _first_time(out)
    )


def distance_to_standing(sight: RoadSight) -> float:
    """Return the distance to the next thing that stands in the car's way if it goes straight on, m."""
    ahead, beside, half_length, half_width, speed, sideways = sight.others.T
    in_way = (ahead > 0.0) & (np.hypot(speed, sideways) < STANDING)
    in_way &= np.abs(beside) < half_width + CAR_HALF_WIDTH + _GAP_ASIDE / 2
    gaps = ahead[in_way] - half_length[in_way] - CAR_HALF_LENGTH
    return float(gaps.min()) if len(gaps) else math.inf


def sideways_past_standing(sight: RoadSight) -> tuple[float, float]:
    """Return how far the car must move to the left, and to the right, to pass what is next in its way, m."""
    ahead, beside, _, half_width, speed, sideways = sight.others.T
    reach = half_width + CAR_HALF_WIDTH + _GAP_ASIDE
    in_way = (ahead > 0.0) & (np.hypot(speed, sideways) < STANDING) & (np.abs(beside) < reach)
    if not in_way.any():
        return 0.0, 0.0
    nearest = ahead[in_way] < ahead[in_way].min() + 2 * CAR_HALF_LENGTH
    return (float((reach + beside)[in_way][nearest].max()), float((reach - beside)[in_way][nearest].max()))


def _first_time(when: NDArray[np.bool_]) -> float:
    return float(TIMES[np.argmax(when)]) if when.any() else math.inf
