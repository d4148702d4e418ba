"""Reads what the operator sees from a robot on a road: nothing that the screen does not show."""

from __future__ import annotations

import math

import numpy as np

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.core.errors import RobotError
from pdtui.core.scenery import Scenery, Traffic
from pdtui.paper.driving.road_sight import ROAD_STEP, SIGHT, RoadSight
from pdtui.paper.driving.route_line import RouteLine
from pdtui.robots.robot import Robot

_STEPS_OF_VELOCITY = 2
"""Control steps over which somebody's velocity is judged."""
_ROAD_BEHIND = 10.0
_OWN = ("speed", "heading", "yaw rate", "left distance", "right distance")


class SightReader:
    """Follows a car along its route, from the first control step on.

    Velocities of others come from where they were a moment ago, as somebody at the screen judges them.

    Args:
        robot: The car; its scenery has a route, and its traffic the boxes around it.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._columns = [robot.attribute_index(name) for name in _OWN]
        self._dt = float(robot.control_dt)
        self._line: RouteLine | None = None
        self._scenery: Scenery | None = None
        self._along: float | None = None
        self._seen: list[dict[tuple[str, int], Floats]] = []

    def look(self, traffic: Traffic) -> RoadSight:
        """Return what there is to see now, with this traffic; call it once per control step."""
        line = self._route_line()
        speed, heading, yaw_rate, left, right = self._robot.read_attributes()[self._columns].tolist()
        place = self._robot.read_poses()[:1, :2]
        low, high = (-math.inf, math.inf) if self._along is None else (self._along - 20.0, self._along + 20.0)
        along, _, direction = line.locate(place, low, high)[0].tolist()
        self._along = along
        ahead = line.points_at(along + np.arange(0.0, SIGHT, ROAD_STEP))
        turned = direction + heading
        apart = ahead - place
        road = np.stack(
            [
                math.cos(turned) * apart[:, 0] + math.sin(turned) * apart[:, 1],
                math.cos(turned) * apart[:, 1] - math.sin(turned) * apart[:, 0],
            ],
            axis=1,
        )
        return RoadSight(
            speed,
            wrap_angle(heading),
            yaw_rate,
            left,
            right,
            self._others(traffic, line, place[0], along),
            road,
        )

    def _others(self, traffic: Traffic, line: RouteLine, place: Floats, along: float) -> Floats:
        seen = read_boxes(self._robot.scenery, traffic)
        self._seen = [*self._seen[-_STEPS_OF_VELOCITY:], seen]
        before = self._seen[0]
        span = (len(self._seen) - 1) * self._dt
        near = {key: box for key, box in seen.items() if math.hypot(*(box[:2] - place)) < SIGHT}
        if not near:
            return np.empty((0, 6))
        boxes = np.array(list(near.values()))
        old = np.array([before.get(key, box)[:2] for key, box in near.items()])
        moved = (boxes[:, :2] - old) / span if span else np.zeros_like(old)
        part = (along - _ROAD_BEHIND - SIGHT, along + SIGHT)
        here = line.locate(boxes[:, :2], *part)
        own = line.locate(place[None], *part)[0]
        angle, road = boxes[:, 2] - here[:, 2], here[:, 2]
        cosine, sine = np.abs(np.cos(angle)), np.abs(np.sin(angle))
        length, width = boxes[:, 3] / 2, boxes[:, 4] / 2
        return np.stack(
            [
                here[:, 0] - own[0],
                here[:, 1] - own[1],
                cosine * length + sine * width,
                sine * length + cosine * width,
                np.cos(road) * moved[:, 0] + np.sin(road) * moved[:, 1],
                np.cos(road) * moved[:, 1] - np.sin(road) * moved[:, 0],
            ],
            axis=1,
        )

    def _route_line(self) -> RouteLine:
        scenery = self._robot.scenery
        if self._line is None or scenery is not self._scenery:
            routes = [line.points[:, :2] for line in scenery.lines if line.kind == "route"]
            if not routes:
                raise RobotError(f"{self._robot.name}: its scenery has no route that an operator could see")
            self._line, self._scenery = RouteLine(routes[0]), scenery
        return self._line


def read_boxes(scenery: Scenery, traffic: Traffic) -> dict[tuple[str, int], Floats]:
    """Return what is around a car: x, y (m), yaw (rad), length and width (m), by kind and number."""
    boxes = np.concatenate([traffic.poses[:, [0, 1, 3]], traffic.sizes[:, :2]], axis=1)
    found: dict[tuple[str, int], Floats] = dict(zip(traffic.keys, boxes, strict=True))
    for number, (x, y, radius) in enumerate(scenery.cylinders.tolist()):
        found["cylinder", number] = np.array([x, y, 0.0, 2 * radius, 2 * radius])
    return found
