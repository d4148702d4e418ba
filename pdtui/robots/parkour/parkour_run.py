"""How far a robot is on a parkour course, which doors are open, and how an attempt ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.core.scenery import BoxKind, Traffic
from pdtui.robots.parkour.parkour_course import HALF_WIDTH, LENGTH, ParkourObstacle, sample_parkour_course

_KIND: BoxKind = "obstacle"
_OPEN_DOOR_ASIDE = 2 * HALF_WIDTH
"""How far to the left an open door is drawn: it has slid out of the lane, m."""


NO_PROGRESS = np.array([0.0, 1.0, -1.0])
NO_BOXES: Floats = np.empty((0, 6))


class ParkourRun:
    """A run along the course of a seed.

    Attributes:
        course: The obstacles.
        progress: How many of them were passed, the number of attempts so far, and how many control steps ago
            the robot passed the sensor of the next one, or −1; shape (3,). It is all that changes.
        crossed: Whether the robot is at the end of the course.

    Args:
        seed: Seed of the course.
        dt: Duration of a control step, s.
    """

    def __init__(self, seed: int, dt: float) -> None:
        self.seed, self._dt = seed, dt
        self.course = sample_parkour_course(np.random.default_rng(seed))
        self.progress = NO_PROGRESS.copy()
        self.crossed = False
        self._closed: tuple[bool, ...] = ()
        self._boxes = NO_BOXES

    @property
    def passed(self) -> int:
        """Number of obstacles passed."""
        return int(self.progress[0])

    @property
    def next_obstacle(self) -> ParkourObstacle | None:
        """The first obstacle that was not passed yet."""
        return self.course[self.passed] if self.passed < len(self.course) else None

    @property
    def attempts(self) -> int:
        """Number of attempts so far."""
        return int(self.progress[1])

    @property
    def blocks_the_way(self) -> bool:
        """Whether the next obstacle is in the way, which an open door is not."""
        return self.passed < len(self.course) and self._is_closed(self.passed)

    @property
    def waited(self) -> float:
        """Time since the robot passed the sensor of the next obstacle, s; negative if it has not."""
        return float(self.progress[2]) * self._dt

    @property
    def restart_place(self) -> float:
        """Where along x an attempt begins: behind the last obstacle that was passed, m."""
        return self.course[self.passed - 1].end if self.passed else 0.0

    def begin_attempt(self) -> None:
        """Begin anew behind the last obstacle that was passed."""
        passed, attempts, _ = self.progress.tolist()
        self.progress = np.array([passed, attempts + 1.0, -1.0])

    def advance(self, x: float, y: float, crashed: bool) -> dict[str, Any]:
        """Note where the robot is after a control step; return what the info says of the attempt's end.

        Args:
            x, y: Place of the trunk, m.
            crashed: Whether the trunk touches an obstacle.
        """
        after = self.progress.copy()
        obstacle = self.next_obstacle
        if obstacle is not None:
            if after[2] >= 0.0 or x > obstacle.sensor:
                after[2] += 1.0
            if x > obstacle.end:
                after[0], after[2] = after[0] + 1.0, -1.0
        self.progress = after
        self.crossed = x > LENGTH
        if crashed:
            what = obstacle.kind if obstacle is not None else "obstacle"
            return {"outcome": Outcome.CRASHED, "reason": f"crashed: ran into the {what} at {x:.1f} m"}
        if abs(y) > HALF_WIDTH:
            return {"outcome": Outcome.LEFT_ROAD, "reason": f"left the lane at {x:.1f} m"}
        if self.crossed:
            return {"outcome": Outcome.ARRIVED, "reason": "crossed the course"}
        return {}

    def boxes_in_the_way(self) -> Floats:
        """Return the boxes that the robot can touch, shape (N, 6), as in `ParkourObstacle`.

        It is the same array until a door opens or closes.
        """
        closed = tuple(self._is_closed(number) for number in range(len(self.course)))
        if closed != self._closed:
            self._closed = closed
            there = [one.boxes for one, way in zip(self.course, closed, strict=True) if way]
            self._boxes = np.concatenate([NO_BOXES, *there])
        return self._boxes

    def read_traffic(self) -> Traffic:
        """Return all boxes; doors that are open stand beside the lane."""
        aside: list[float] = []
        for number, one in enumerate(self.course):
            aside += [0.0 if self._is_closed(number) else _OPEN_DOOR_ASIDE] * len(one.boxes)
        boxes = np.concatenate([one.boxes for one in self.course])
        poses = np.column_stack([boxes[:, :3], np.zeros(len(boxes))])
        poses[:, 1] += aside
        kinds = (_KIND,) * len(boxes)
        return Traffic(np.arange(len(boxes)), kinds, poses, boxes[:, 3:].copy())

    def _is_closed(self, number: int) -> bool:
        """Return whether an obstacle's boxes are in the way. A door that was passed stays open."""
        obstacle = self.course[number]
        if number < self.passed:
            return obstacle.kind not in ("closing door", "opening door")
        return obstacle.is_closed(self.waited if number == self.passed else -1.0)
