"""What the operator sees at one moment: the road, the car on it, and what else is there."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.paper.driving.route_line import RouteLine

LANE_WIDTH = 3.5
"""Width of a lane, m."""
CAR_HALF_LENGTH, CAR_HALF_WIDTH = 2.26, 0.93
"""Half the length and the width of the car, m."""
SIGHT = 50.0
"""How far the operator sees, m."""
ROAD_STEP = 2.0
"""Distance between points of the road ahead, m."""
STANDING = 0.5
"""Largest speed of something that counts as standing, m/s."""
_ALIGNED = 0.35
"""Largest angle between a car on the road and the road with which it is expected to follow the road, rad."""
_MOST_TURNED = 1.6
"""Angle by which a car is expected to turn at most, rad."""
_SWERVE_TIME = 0.8
"""Time in which a car that follows the road has drifted sideways, s."""
_BEND_LENGTH = 4.0
_ROAD_BEHIND = 60.0


def _nothing() -> Floats:
    return np.empty((0, 7))


@dataclass(frozen=True, eq=False)
class RoadSight:
    """A moment on the road.

    Attributes:
        line: The route, along the middle of its roads.
        along, beside: Place of the car's middle: along the line and to its left, m.
        speed: Speed of the car, m/s.
        heading: Its heading relative to the line's, to the left, rad.
        yaw_rate: How fast it turns to the left, rad/s.
        left, right: Distances of its middle from the edges of the road, m.
        others: Cars and obstacles within `SIGHT`: x, y (m), yaw (rad), half the length and the width (m),
            speed (m/s) and yaw rate (rad/s), shape (N, 7).
        age: How long ago the others were there, s.
    """

    line: RouteLine
    along: float
    beside: float
    speed: float
    heading: float
    yaw_rate: float
    left: float
    right: float
    others: Floats = field(default_factory=_nothing)
    age: float = 0.0

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return max(1, round((self.left + self.right) / LANE_WIDTH))

    @property
    def lane(self) -> int:
        """Number of the lane that the car's middle is in, from the right; the first is 0."""
        return int(np.clip(self.right // LANE_WIDTH, 0, self.lanes - 1))

    @property
    def swing(self) -> float:
        """How fast the car's heading relative to the road changes, rad/s."""
        return self.yaw_rate - self.speed * self.bend(0.0)

    def to_middle_of(self, lane: int) -> float:
        """Return the distance to the left from the car's middle to that of a lane, m."""
        return (lane + 0.5) * (self.left + self.right) / self.lanes - self.right

    def bend(self, ahead: float) -> float:
        """Return the curvature of the road some distance ahead, positive to the left, 1/m."""
        here = self.along + ahead
        points = self.line.points_at(np.array([here - _BEND_LENGTH, here, here + _BEND_LENGTH]))
        first, second = np.diff(points, axis=0)
        turned = math.atan2(second[1], second[0]) - math.atan2(first[1], first[0])
        return wrap_angle(turned) / _BEND_LENGTH

    def road_ahead(self) -> Floats:
        """Return the line from beside the car on, in the car's own directions, forward and left, m.

        The points, shape (M, 2), are `ROAD_STEP` apart.
        """
        points = self.line.points_at(self.along + np.arange(0.0, SIGHT, ROAD_STEP))
        first, second = self.line.points_at(np.array([self.along, self.along + 0.1]))
        angle = math.atan2(*(second - first)[::-1]) + self.heading
        cosine, sine = math.cos(angle), math.sin(angle)
        x, y = (points - points[0]).T
        aside = self.beside * np.array([math.sin(self.heading), math.cos(self.heading)])
        return np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=1) - aside

    def foresee(self, times: Floats) -> Floats:
        """Return where the others will be if they keep on doing what they do.

        A car on the road that heads along it follows it; others keep their speed and their yaw rate.

        Args:
            times: s from now, shape (T,).

        Returns:
            Distances along the road and to the left from where the car is now, and half the extents along and
            across the road, m, shape (N, T, 4).
        """
        x, y, yaw, length, width, speed, turning = (column[:, None] for column in self.others.T)
        later = times + self.age
        now, tilt = self._places
        tilt, beside = tilt[:, None], now[:, 1:2] - self.beside
        follows = self.followers[:, None]
        turn = np.clip(turning * later, -_MOST_TURNED, _MOST_TURNED)
        chord = speed * later * np.sinc(turn / (2.0 * np.pi))
        places = np.stack([x + chord * np.cos(yaw + turn / 2), y + chord * np.sin(yaw + turn / 2)], axis=-1)
        found = self._locate(places.reshape(-1, 2)).reshape(*places.shape[:2], 3)
        swerve = speed * np.sin(tilt) * _SWERVE_TIME * (1.0 - np.exp(-later / _SWERVE_TIME))
        ahead = np.where(follows, now[:, :1] + speed * np.cos(tilt) * later, found[..., 0]) - self.along
        aside = np.where(follows, beside + swerve, found[..., 1] - self.beside)
        angle = np.where(follows, tilt, yaw + turn - found[..., 2])
        cosine, sine = np.abs(np.cos(angle)), np.abs(np.sin(angle))
        return np.stack(
            [ahead, aside, cosine * length + sine * width, sine * length + cosine * width], axis=-1
        )

    @cached_property
    def followers(self) -> NDArray[np.bool_]:
        """Which of the others drive along the road, this way or towards the car, shape (N,)."""
        places, tilt = self._places
        beside = places[:, 1] - self.beside
        on_road = (beside < self.left + 1.0) & (beside > -self.right - 1.0) & (np.abs(tilt) < _ALIGNED)
        oncoming = (np.abs(beside) < self.left + self.right) & (np.abs(tilt) > math.pi - _ALIGNED)
        return np.asarray((on_road | oncoming) & (self.others[:, 5] > STANDING))

    @cached_property
    def _places(self) -> tuple[Floats, Floats]:
        """Where the others were, as `RouteLine.locate`, and their headings relative to the road's, rad."""
        places = self._locate(self.others[:, :2])
        apart = self.others[:, 2] - places[:, 2]
        return places, np.asarray((apart + math.pi) % (2.0 * math.pi) - math.pi)

    def standing(self) -> Floats:
        """Return what stands, as `foresee` does, shape (N, 4)."""
        now: Floats = self.foresee(np.zeros(1))[self.others[:, 5] < STANDING, 0]
        return now

    def _locate(self, places: Floats) -> Floats:
        return self.line.locate(places, self.along - _ROAD_BEHIND, self.along + SIGHT + 30.0)
