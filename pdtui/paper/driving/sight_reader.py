"""Reads what the operator sees from a robot on a road: nothing that the screen does not show."""

from __future__ import annotations

import math

import numpy as np

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.core.errors import RobotError
from pdtui.core.scenery import Scenery, Traffic
from pdtui.paper.driving.road_sight import SIGHT, RoadSight
from pdtui.paper.driving.route_line import RouteLine
from pdtui.robots.robot import Robot

_STEPS_OF_VELOCITY = 2
"""Control steps over which somebody's velocity is judged."""
_OWN = ("speed", "yaw rate", "left distance", "right distance")


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
        speed, yaw_rate, left, right = self._robot.read_attributes()[self._columns].tolist()
        pose = self._robot.read_poses()[0]
        low, high = (-math.inf, math.inf) if self._along is None else (self._along - 4.0, self._along + 8.0)
        along, beside, direction = line.locate(pose[None, :2], low, high)[0].tolist()
        self._along = along
        w, x, y, z = pose[3:]
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        heading = wrap_angle(yaw - direction)
        return RoadSight(
            line, along, beside, speed, heading, yaw_rate, left, right, self._others(traffic, pose[:2])
        )

    def _others(self, traffic: Traffic, place: Floats) -> Floats:
        seen = read_boxes(self._robot.scenery, traffic)
        self._seen = [*self._seen[-_STEPS_OF_VELOCITY:], seen]
        before = self._seen[0]
        span = (len(self._seen) - 1) * self._dt
        near = {key: box for key, box in seen.items() if math.hypot(*(box[:2] - place)) < SIGHT}
        if not near:
            return np.empty((0, 7))
        boxes = np.array(list(near.values()))
        moved = boxes[:, :3] - np.array([before.get(key, box)[:3] for key, box in near.items()])
        moved[:, 2] = [wrap_angle(angle) for angle in moved[:, 2]]
        rates = moved / span if span else np.zeros_like(moved)
        speeds = np.hypot(rates[:, 0], rates[:, 1])
        return np.column_stack([boxes[:, :3], boxes[:, 3:5] / 2, speeds, rates[:, 2]])

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
