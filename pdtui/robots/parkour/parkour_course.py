"""A course of obstacles, drawn from a random generator, without a simulator.

The course is a lane along x, 40 m long. A policy that walks straight on passes none of its obstacles; see the
results in the guide for how that was measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from pdtui.core.attributes import Floats

ObstacleKind = Literal["gate", "bar", "closing door", "opening door"]
OBSTACLE_KINDS: tuple[ObstacleKind, ...] = get_args(ObstacleKind)
LENGTH, HALF_WIDTH = 40.0, 3.3
"""Length of the lane and half its width, m."""
BAR_BOTTOM = 1.005
"""Height of a bar's lower edge, m."""
CLOSING_TIME, OPENING_TIME = 2.3, 6.0
"""Time after which a door closes or opens, once the robot is past the sensor before it, s."""
SENSOR_DISTANCE = 3.0
"""Distance of a door from its sensor, m."""
OPENING_WIDTH = 1.3
"""Width of a gate's opening, m."""
# Distances of the middle of a gate's opening from the middle of the lane, m.
_ASIDE = (1.9, 2.15)
# Place of the first obstacle, distance to the next one, and how far each may be shifted, m.
_FIRST, _SPACING, _SHIFT = 4.0, 5.0, 1.0
COUNT = 7
# Thickness of walls and doors, and their height, m; thickness of a bar, m.
_WALL, _WALL_HEIGHT, _BAR = 0.1, 1.3, 0.06
# Distance beyond an obstacle at which it counts as passed: the robot's legs are behind its trunk, m.
_BEYOND = 0.5


@dataclass(frozen=True, eq=False)
class ParkourObstacle:
    """One obstacle of a course.

    Attributes:
        kind: What it is.
        place: Where it is along x, m.
        boxes: Middles x y z and sizes along x y z of what is in the way, m, shape (N, 6). A door is one box,
            which is there while the door is closed.
        opening: The middle of a gate's opening along y, m; 0 for others.
    """

    kind: ObstacleKind
    place: float
    boxes: Floats
    opening: float = 0.0

    @property
    def end(self) -> float:
        """Where along x it has been passed, m."""
        return self.place + _BEYOND

    @property
    def sensor(self) -> float:
        """Where along x the time of a door begins, m."""
        return self.place - SENSOR_DISTANCE

    def is_closed(self, waited: float) -> bool:
        """Return whether its boxes are in the way.

        Args:
            waited: Time since the robot passed the sensor, s; negative if it has not.
        """
        if self.kind == "closing door":
            return waited >= CLOSING_TIME
        return self.kind != "opening door" or waited < OPENING_TIME


def sample_parkour_course(rng: np.random.Generator) -> tuple[ParkourObstacle, ...]:
    """Draw seven obstacles, in their order along the lane: of every kind, and none twice in a row."""
    kinds = _draw_kinds(rng)
    places = _FIRST + _SPACING * np.arange(COUNT) + rng.uniform(0.0, _SHIFT, COUNT)
    side = 1.0 if rng.random() < 0.5 else -1.0
    course = []
    for kind, place in zip(kinds, places.tolist(), strict=True):
        if kind == "gate":
            side = -side
            course.append(_build_gate(place, side * float(rng.uniform(*_ASIDE))))
        elif kind == "bar":
            course.append(_build_bar(place))
        else:
            course.append(ParkourObstacle(kind, place, _slab(place, -HALF_WIDTH, HALF_WIDTH)))
    return tuple(course)


def _draw_kinds(rng: np.random.Generator) -> list[ObstacleKind]:
    first: list[ObstacleKind] = list(OBSTACLE_KINDS)
    rng.shuffle(first)
    more: list[ObstacleKind] = list(OBSTACLE_KINDS)
    rng.shuffle(more)
    if more[0] == first[-1]:
        more.reverse()
    return [*first, *more][:COUNT]


def _build_gate(place: float, opening: float) -> ParkourObstacle:
    right, left = opening - OPENING_WIDTH / 2, opening + OPENING_WIDTH / 2
    walls = np.vstack([_slab(place, -HALF_WIDTH, right), _slab(place, left, HALF_WIDTH)])
    return ParkourObstacle("gate", place, walls, opening)


def _build_bar(place: float) -> ParkourObstacle:
    box = [place, 0.0, BAR_BOTTOM + _BAR / 2, _BAR, 2 * HALF_WIDTH, _BAR]
    return ParkourObstacle("bar", place, np.array([box]))


def _slab(place: float, low: float, high: float) -> Floats:
    """Return the box of a wall across the lane from one y to another, shape (1, 6)."""
    middle, width = (low + high) / 2, high - low
    return np.array([[place, middle, _WALL_HEIGHT / 2, _WALL, width, _WALL_HEIGHT]])
