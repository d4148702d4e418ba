"""What MetaDrive has around the car, as scenery and traffic."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.scenery import BoxKind, LineKind, RoadLine, Scenery, Traffic
from pdtui.robots.road.metadrive_repairs import FIRST_RAY, LIDAR_RANGE, LIDAR_RAYS

# Distance between points of a line that bends, m.
_SPACING = 3.0


def read_scenery(env: Any) -> Scenery:
    """Return the lines of the road, the route, and the cones and warning signs."""
    network, things = env.current_map.road_network, env.engine.get_objects().values()
    lines = [line for road in _roads(network) for line in _read_lane_lines(road)]
    cones = [[*thing.position, thing.RADIUS] for thing in things if _is_cone(thing)]
    return Scenery((*lines, *_read_route(env.agent.navigation, network)), np.array(cones).reshape(-1, 3))


class TrafficReader:
    """Reads the boxes around the car, and keeps each one's number as long as it is there."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def read(self, env: Any, observation: NDArray[np.float32]) -> Traffic:
        """Return cars, barriers and what the lidar hits.

        Args:
            env: MetaDrive's environment.
            observation: What the policy observes, with the lidar's rays.
        """
        boxes = {name: thing for name, thing in env.engine.get_objects().items() if _is_box(thing, env.agent)}
        self._numbers = {name: number for name, number in self._numbers.items() if name in boxes}
        free = (number for number in range(len(boxes)) if number not in set(self._numbers.values()))
        for name in boxes:
            if name not in self._numbers:
                self._numbers[name] = next(free)
        kinds: tuple[BoxKind, ...] = tuple(
            "vehicle" if _is_vehicle(thing) else "obstacle" for thing in boxes.values()
        )
        poses = [[*thing.position, 0.5 * thing.HEIGHT, thing.heading_theta] for thing in boxes.values()]
        sizes = [[*_footprint(thing), thing.HEIGHT] for thing in boxes.values()]
        return Traffic(
            np.array([self._numbers[name] for name in boxes], np.int64),
            kinds,
            np.array(poses, np.float64).reshape(-1, 4),
            np.array(sizes, np.float64).reshape(-1, 3),
            _lidar_hits(env.agent, observation),
        )


def _roads(network: Any) -> Iterator[list[Any]]:
    """Yield the lanes of each road, from the left one to the right one."""
    for ends in network.graph.values():
        yield from ends.values()


def _read_lane_lines(lanes: list[Any]) -> Iterator[RoadLine]:
    """Yield the line on the left of the first lane and those on the right of all lanes."""
    sides = [(lanes[0], 0), *((lane, 1) for lane in lanes)]
    for lane, side in sides:
        kind = _line_kind(str(lane.line_types[side]))
        if kind is not None:
            # MetaDrive counts offsets from the middle of a lane to the right.
            yield RoadLine(kind, _sample(lane, (side - 0.5) * lane.width))


def _line_kind(line_type: str) -> LineKind | None:
    """Return our word for one of MetaDrive's line types, None for a line that is not there."""
    name = line_type.lower()
    if "none" in name:
        return None
    if "broken" in name:
        return "broken lane line"
    return "road edge" if "side" in name or "guardrail" in name or "grass" in name else "solid lane line"


def _sample(lane: Any, offset: float) -> Floats:
    straight = type(lane).__name__ == "StraightLane"
    count = 2 if straight else max(2, math.ceil(lane.length / _SPACING) + 1)
    return np.array([lane.position(along, offset) for along in np.linspace(0.0, lane.length, count)])


def _read_route(navigation: Any, network: Any) -> Iterator[RoadLine]:
    """Yield the route along the middle lane of each road."""
    nodes = navigation.checkpoints
    pieces = []
    for start, end in pairwise(nodes):
        lanes = network.graph.get(start, {}).get(end)
        if lanes:
            pieces.append(_sample(lanes[len(lanes) // 2], 0.0))
    if pieces:
        yield RoadLine("route", np.concatenate(pieces))


def _is_vehicle(thing: Any) -> bool:
    return hasattr(thing, "max_speed_km_h")


def _is_cone(thing: Any) -> bool:
    return hasattr(thing, "RADIUS") and not _is_vehicle(thing)


def _is_box(thing: Any, car: Any) -> bool:
    return thing is not car and not _is_cone(thing) and hasattr(thing, "LENGTH")


def _footprint(thing: Any) -> tuple[float, float]:
    """Return the extents of a box along its heading and across it, m: a barrier's length lies across."""
    return (thing.LENGTH, thing.WIDTH) if _is_vehicle(thing) else (thing.WIDTH, thing.LENGTH)


def _lidar_hits(car: Any, observation: NDArray[np.float32]) -> Floats:
    rays = observation[FIRST_RAY:].astype(np.float64)
    hit = np.flatnonzero(rays < 1.0)
    angles = car.heading_theta - hit * (2.0 * math.pi / LIDAR_RAYS)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    hits: Floats = np.array(car.position) + rays[hit, None] * LIDAR_RANGE * directions
    return hits
