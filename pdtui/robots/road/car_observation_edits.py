"""Edits of what the car observes of itself and its road: where it is, where it heads, and how fast it drives.

What it observes of other cars, and the lidar, stay as they are, so that the policy still sees them where they
are. `repair_observation` has the order of the observation.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.robots.observation_edits.observation_edit import ObservationEdit

WIDEST_ROAD, WIDEST_LANE = 18.0, 4.5
"""Widest road and widest lane, by which MetaDrive divides distances, m."""
SPEED_SCALE, SPEED_OFFSET = 3.6 / 81.0, 1.0 / 81.0
"""What MetaDrive observes of a speed in m/s: the share of 80 km/h, with 1 km/h added to both."""
_LEFT, _RIGHT, _HEADING, _SPEED, _IN_LANE = 0, 1, 2, 3, 8
_CHECKPOINTS, _CHECKPOINT_RANGE = (9, 14), 50.0
# Width of the lanes of all scenes, m.
_LANE = 3.5


def _move(observation: Floats, offset: float) -> Floats:
    edited, turned = observation.copy(), _read_heading(observation)
    left, right = (WIDEST_ROAD * observation[[_LEFT, _RIGHT]] + (-offset, offset)).tolist()
    edited[_LEFT], edited[_RIGHT] = left / WIDEST_ROAD, right / WIDEST_ROAD
    lanes = max(1, round((left + right) / _LANE))
    lane = min(max(math.floor(left / _LANE), 0), lanes - 1)  # beside the road, it is the outermost one
    edited[_IN_LANE] = 0.5 + (left - (lane + 0.5) * _LANE) / WIDEST_LANE
    ahead, rightward = -offset * math.sin(turned), offset * math.cos(turned)
    return _change_checkpoints(edited, lambda x, y, far: (x, y) if far else (x + ahead, y + rightward))


def _place_in_lane(observation: Floats, offset: float) -> Floats:
    return _move(observation, offset - WIDEST_LANE * (0.5 - float(observation[_IN_LANE])))


def _turn(observation: Floats, angle: float) -> Floats:
    edited, (c, s) = observation.copy(), (math.cos(angle), math.sin(angle))
    edited[_HEADING] = 0.5 - 0.5 * math.sin(_read_heading(observation) + angle)
    return _change_checkpoints(edited, lambda x, y, _: (c * x - s * y, s * x + c * y))


def _speed_up(observation: Floats, offset: float) -> Floats:
    edited = observation.copy()
    edited[_SPEED] = min(max(observation[_SPEED] + SPEED_SCALE * offset, 0.0), 1.0)
    return edited


def _set_speed(observation: Floats, speed: float) -> Floats:
    return _speed_up(observation, speed - (float(observation[_SPEED]) - SPEED_OFFSET) / SPEED_SCALE)


def _read_heading(observation: Floats) -> float:
    """Return how far the car is turned to the left from its road, rad; it observes no angle beyond ±π/2."""
    return math.asin(min(max(1.0 - 2.0 * float(observation[_HEADING]), -1.0), 1.0))


def _change_checkpoints(
    edited: Floats, change: Callable[[float, float, bool], tuple[float, float]]
) -> Floats:
    """Change where the checkpoints are, forward and to the right in m, and keep all numbers in [0, 1].

    Of one that is `far`, 50 m or more away, only the direction is observed.
    """
    for place in _CHECKPOINTS:
        x, y = ((2.0 * edited[place : place + 2] - 1.0) * _CHECKPOINT_RANGE).tolist()
        x, y = change(x, y, math.hypot(x, y) > _CHECKPOINT_RANGE - 1e-3)
        scale = 0.5 / max(_CHECKPOINT_RANGE, math.hypot(x, y))
        edited[place : place + 2] = 0.5 + scale * x, 0.5 + scale * y
    return np.clip(edited, 0.0, 1.0)


CAR_OBSERVATION_EDITS = (
    ObservationEdit(
        "sideways offset",
        "m",
        "the car is further to the left on its road by this much; checkpoints of the route that are more "
        "than 50 m away stay in their direction",
        _move,
    ),
    ObservationEdit(
        "lane offset", "m", "the car is this far to the left of the middle of its lane", _place_in_lane
    ),
    ObservationEdit(
        "heading offset",
        "rad",
        "the car is turned to the left on its road by this much",
        _turn,
        2.0 * math.pi,
    ),
    ObservationEdit("speed offset", "m/s", "the car is faster by this much", _speed_up),
    ObservationEdit("speed", "m/s", "the car drives at this speed", _set_speed),
)
"""The edits that the car offers of its observation."""
