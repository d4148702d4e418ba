"""What the car may do in the next seconds, and when it would come too close to something."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.paper.driving.road_sight import CAR_HALF_LENGTH, CAR_HALF_WIDTH, STANDING, RoadSight

HORIZON = 5.0
"""How far a prediction reaches, s."""
TIMES: Floats = np.linspace(0.2, HORIZON, 25)
"""Its moments, s from now."""
STRAIGHTENING_TIME = 0.5
"""Time in which a policy turns the car back along the road, s."""
WEAVING = 0.25
"""Angle to the road up to which a car straightens at once, rad."""
_NEAR_EDGE, _SLIPPING_TIME, INWARDS = 0.6, 0.4, 0.1
"""Distance from an edge of the road that is too small now or after some time, m and s, and the angle by which
the car must at least turn away from it, rad."""
GAP_AHEAD, GAP_BRAKED = 1.5, 0.5
"""Gaps to others lengthways that are too close while driving on, and while braking, m."""
_GAP_ASIDE, _GAP_TO_EDGE = 0.35, 0.5
"""Gaps that are too close, m: to others sideways, and from the car's middle to an edge."""
ROOM_FOR_CROSSING = 1.5
"""How much more room to leave for those who cross the road, m."""
_SWING_TIME = 0.1
"""Time in which the car ends a turn that nobody wants, s."""
_TURNING_SPEED = 5.0
"""Speed below which it turns the more slowly the slower it is, m/s."""
_LANE_LEFT = 1.0
"""Distance to the side from which on those who come from behind count, m."""


@dataclass(frozen=True, eq=False)
class Maneuver:
    """A way on from now.

    Attributes:
        name: Name of the key that begins it; empty to let the car go on.
        ahead, beside: Places along the road and to the left of here at `TIMES`, m, shape (T,) each.
        gap: Gap to others lengthways that is too close, m.
    """

    name: str
    ahead: Floats
    beside: Floats
    gap: float = GAP_AHEAD


@dataclass(frozen=True)
class TimesToConflict:
    """When a maneuver comes too close to something, s from now; infinite if it does not within `TIMES`.

    Attributes:
        standing: To something that stands.
        moving: To something that drives along the road.
        crossing: To something that moves in another direction.
        edge: To an edge of the road.
        duration: How long it is too close to anything but an edge within `TIMES`, s.
    """

    standing: float
    moving: float
    crossing: float
    edge: float
    duration: float

    @property
    def first(self) -> float:
        """The first of them."""
        return min(self.standing, self.moving, self.crossing, self.edge)


def roll(speed: float, acceleration: float, top: float = math.inf) -> Floats:
    """Return how far a car gets, m, at `TIMES`; it neither rolls backwards nor gets faster than `top`."""
    times = np.concatenate([[0.0], TIMES])
    speeds = np.clip(speed + acceleration * times, 0.0, max(top, speed))
    return np.asarray(np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(times)))


def swerve(sight: RoadSight, ahead: Floats, turns: Floats, turn_now: float = 0.0) -> Floats:
    """Return how far the car gets to the left, m, at `TIMES`.

    It straightens by itself within `STRAIGHTENING_TIME`; what else it turns just now ends sooner.

    Args:
        sight: What there is to see.
        ahead: Its way along the road, m, at `TIMES`.
        turns: How fast keys turn it to the left until each of `TIMES`, rad/s.
        turn_now: How fast a key turns it now, rad/s.
    """
    step = float(TIMES[1] - TIMES[0])
    # The less it is turned, the more of that is only the policy's weaving.
    heading = sight.heading * min(1.0, abs(sight.heading) / WEAVING)
    beside, before, places = 0.0, 0.0, []
    own = sight.swing + heading / STRAIGHTENING_TIME - turn_now if abs(sight.heading) > WEAVING else 0.0
    for place, turn in zip(ahead.tolist(), turns.tolist(), strict=True):
        way, before = place - before, place
        share = min(1.0, way / step / _TURNING_SPEED)
        heading += step * share * (turn + own - heading / STRAIGHTENING_TIME)
        own *= math.exp(-step / _SWING_TIME)
        beside += way * math.sin(max(-1.2, min(1.2, heading)))
        places.append(beside)
    return np.array(places)


def predict_times_to_conflict(
    sight: RoadSight, maneuver: Maneuver, room: float = 0.0, doubt: float = 0.0
) -> TimesToConflict:
    """Return when a maneuver comes too close to what is seen, if everybody else goes on as before.

    Args:
        sight: What there is to see.
        maneuver: The maneuver.
        room: How much more room to leave lengthways for those who cross the road, m.
        doubt: How much faster or slower than seen somebody who crosses the road may also turn, rad/s.
    """
    if doubt:
        crossing = (sight.others[:, 5] > STANDING) & ~sight.followers
        more = np.repeat(sight.others[crossing], 2, axis=0)
        more[:, 6] += np.tile([doubt, -doubt], len(more) // 2)
        sight = replace(sight, others=np.concatenate([sight.others, more]))
    out = (maneuver.beside > sight.left - _GAP_TO_EDGE) & (maneuver.beside > 0.1)
    out |= (maneuver.beside < _GAP_TO_EDGE - sight.right) & (maneuver.beside < -0.1)
    ahead, beside, half_length, half_width = np.moveaxis(sight.foresee(TIMES), -1, 0)
    apart, aside = ahead - maneuver.ahead, beside - maneuver.beside
    stands = sight.others[:, 5] < STANDING
    kinds = stands, sight.followers, ~stands & ~sight.followers
    gap = np.where(kinds[2], maneuver.gap + room, maneuver.gap)[:, None]
    close = np.abs(apart) < half_length + CAR_HALF_LENGTH + gap
    close &= np.abs(aside) < half_width + CAR_HALF_WIDTH + _GAP_ASIDE
    # Who comes from behind in the same lane keeps away by himself.
    follower = (ahead[:, :1] < 0.0) & (np.abs(beside[:, :1]) < half_width[:, :1] + CAR_HALF_WIDTH)
    close &= ~follower | (np.abs(maneuver.beside) > _LANE_LEFT)
    standing, along, across = (_first_time(close[kind].any(axis=0)) for kind in kinds)
    duration = float(close.any(axis=0).sum() * (TIMES[1] - TIMES[0]))
    return TimesToConflict(standing, along, across, _first_time(out), duration)


def slips_off(sight: RoadSight) -> int:
    """Return 1 if the car is about to slip over the edge on its left, −1 on its right, 0 if neither."""
    room, side = (sight.left, 1) if sight.left < sight.right else (sight.right, -1)
    turned = side * sight.heading
    soon = room - max(0.0, turned - INWARDS) * sight.speed * _SLIPPING_TIME
    return side if soon < _NEAR_EDGE and turned > -INWARDS else 0


def next_standing(sight: RoadSight) -> tuple[float, float]:
    """Return where the next thing stands that is in the car's way if it goes straight on.

    Returns:
        Distance to it and how far its middle is to the left, m; infinite and 0 if there is none.
    """
    ahead, beside, half_length, half_width = sight.standing().T
    in_way = (ahead > 0.0) & (np.abs(beside) < half_width + CAR_HALF_WIDTH + _GAP_ASIDE / 2)
    if not in_way.any():
        return math.inf, 0.0
    gaps = np.where(in_way, ahead - half_length - CAR_HALF_LENGTH, math.inf)
    nearest = int(np.argmin(gaps))
    return float(gaps[nearest]), float(beside[nearest])


def find_passing_offset(sight: RoadSight, within: float) -> float:
    """Return how far to the left the car must get to pass what stands next in its way, m.

    Negative to the right; 0 if nothing stands there, or neither side has room.

    Args:
        sight: What there is to see.
        within: Distance up to which it counts, m.
    """
    gap, _ = next_standing(sight)
    if gap > within:
        return 0.0
    ahead, beside, half_length, half_width = sight.standing().T
    near = (ahead + half_length > -CAR_HALF_LENGTH) & (ahead - half_length < gap + 3.0 * CAR_HALF_LENGTH)
    places, reach = beside[near], half_width[near] + CAR_HALF_WIDTH + _GAP_ASIDE
    ways = np.concatenate([places + reach, places - reach])
    free = (np.abs(ways[:, None] - places) > reach - 1e-6).all(axis=1)
    free &= (ways < sight.left - CAR_HALF_WIDTH) & (ways > CAR_HALF_WIDTH - sight.right)
    return float(min(ways[free], key=abs, default=0.0))


def _first_time(when: NDArray[np.bool_]) -> float:
    return float(TIMES[np.argmax(when)]) if when.any() else math.inf
