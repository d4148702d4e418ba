"""What the operator sees at one moment: the road, the car on it, and what else is there."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pdtui.core.attributes import Floats

LANE_WIDTH = 3.5
"""Width of a lane, m."""
CAR_HALF_LENGTH, CAR_HALF_WIDTH = 2.26, 0.93
"""Half the length and the width of the car, m."""
SIGHT = 50.0
"""How far the operator sees, m."""


def _nothing() -> Floats:
    return np.empty((0, 6))


@dataclass(frozen=True, eq=False)
class RoadSight:
    """A moment on the road, in the road's own directions: along it and to its left.

    Attributes:
        speed: Speed of the car, m/s.
        heading: Its heading relative to the road's, to the left, rad.
        yaw_rate: How fast it turns to the left, rad/s.
        left, right: Distances of its middle from the edges of the road, m.
        others: Cars and obstacles within `SIGHT`: distances along the road and to the left from the car's
            middle to theirs, half their extents along and across the road, m, and their speeds along the road
            and to the left, m/s, shape (N, 6).
        road: The middle line of the road ahead in the car's own directions, forward and left, m, shape
            (M, 2); neighboring points are `ROAD_STEP` apart, the first is beside the car.
    """

    speed: float
    heading: float
    yaw_rate: float
    left: float
    right: float
    others: Floats = field(default_factory=_nothing)
    road: Floats = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return max(1, round((self.left + self.right) / LANE_WIDTH))

    @property
    def lane(self) -> int:
        """Number of the lane that the car's middle is in, from the right; the first is 0."""
        return int(np.clip(self.right // LANE_WIDTH, 0, self.lanes - 1))

    def to_middle_of(self, lane: int) -> float:
        """Return the distance to the left from the car's middle to that of a lane, m."""
        return (lane + 0.5) * (self.left + self.right) / self.lanes - self.right


ROAD_STEP = 2.0
"""Distance between points of the road ahead, m."""
