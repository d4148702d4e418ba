"""Plain data about what is around a robot: scenery, which stands still, and traffic, which moves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError

LineKind = Literal["solid lane line", "broken lane line", "road edge", "route"]
BoxKind = Literal["vehicle", "obstacle"]
_DASH, _GAP = 3.0, 5.0
"""Lengths of the dashes of a broken line and of the gaps between them, m."""


def _no_rows(columns: int) -> Floats:
    return np.empty((0, columns))


@dataclass(frozen=True, eq=False)
class RoadLine:
    """A polyline on a road: paint, the edge of the road, or the route that the robot is to take.

    Attributes:
        kind: what the line is. A broken lane line is given whole, not dash by dash.
        points: x and y, or x, y and z, in m, shape (N, 2) or (N, 3), in order along the line.

    Raises:
        RobotError: the points have another shape or are not finite.
    """

    kind: LineKind
    points: Floats

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] not in (2, 3):
            raise RobotError(
                f"scenery: {self.kind}: expected points of shape (N, 2) or (N, 3), found {self.points.shape}"
            )
        if not np.isfinite(self.points).all():
            raise RobotError(f"scenery: {self.kind}: expected finite points, found NaN or infinity")

    def painted_pieces(self) -> list[Floats]:
        """Return the line as it is drawn: polylines through x, y and z, each of shape (K, 3), K > 1.

        It is one piece; a broken lane line is many dashes. A line of fewer than two points has none.
        """
        count, columns = self.points.shape
        points = np.concatenate([self.points, np.zeros((count, 3 - columns))], axis=1)
        if count < 2:
            return []
        return _cut_into_dashes(points) if self.kind == "broken lane line" else [points]


@dataclass(frozen=True, eq=False)
class Scenery:
    """What stands still around a robot, for screen and viewer.

    One object stands for one world: it is sent and recorded again only when another object takes its place.

    Attributes:
        lines: lines of the roads; a world with any is a road, and is drawn as one.
        cylinders: upright cylinders, such as tree trunks and traffic cones: x, y and radius, m, shape (N, 3).

    Raises:
        RobotError: the cylinders have another shape.
    """

    lines: tuple[RoadLine, ...] = ()
    cylinders: Floats = field(default_factory=lambda: _no_rows(3))

    def __post_init__(self) -> None:
        _check_shape("scenery: cylinders", self.cylinders, (len(self.cylinders), 3))


@dataclass(frozen=True, eq=False)
class Traffic:
    """What may move around a robot, as it is at one control step: N boxes, and what a lidar hits.

    Attributes:
        identities: whole numbers by which boxes are told apart from step to step, shape (N,). A number
            belongs to one box for as long as that is there, and may then be given to another. A session has
            an entity per kind and number, so robots that use few different ones make small sessions.
        kinds: what the boxes are; N of them.
        poses: x, y and z of their centers, m, and yaw, rad, shape (N, 4).
        sizes: length (along a box's own x axis), width and height, m, shape (N, 3).
        lidar_hits: x and y of the points that the robot's lidar hits, m, shape (M, 2).

    Raises:
        RobotError: an array has another shape, or two boxes of a kind have one number.
    """

    identities: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    kinds: tuple[BoxKind, ...] = ()
    poses: Floats = field(default_factory=lambda: _no_rows(4))
    sizes: Floats = field(default_factory=lambda: _no_rows(3))
    lidar_hits: Floats = field(default_factory=lambda: _no_rows(2))

    def __post_init__(self) -> None:
        count = len(self.identities)
        _check_shape("traffic: poses", self.poses, (count, 4))
        _check_shape("traffic: sizes", self.sizes, (count, 3))
        _check_shape("traffic: lidar hits", self.lidar_hits, (len(self.lidar_hits), 2))
        if len(self.kinds) != count:
            raise RobotError(f"traffic: expected {count} kinds, one per box, found {len(self.kinds)}")
        if len(set(self.keys)) != count:
            raise RobotError(f"traffic: expected a number of its own for each box, found {self.keys}")

    @property
    def keys(self) -> list[tuple[BoxKind, int]]:
        """Kind and number of each box, by which it is told apart from all others."""
        return list(zip(self.kinds, self.identities.tolist(), strict=True))


def _cut_into_dashes(points: Floats) -> list[Floats]:
    """Return the dashes of a polyline, shape (N, 3), N > 1; the first begins where the line does."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=-1))])
    pieces = []
    for start in np.arange(0.0, along[-1], _DASH + _GAP):
        end = min(start + _DASH, along[-1])
        places = np.array([start, *along[(along > start) & (along < end)], end])
        pieces.append(np.stack([np.interp(places, along, axis) for axis in points.T], axis=-1))
    return pieces


def _check_shape(name: str, array: Floats, shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise RobotError(f"{name}: expected shape {shape}, found {array.shape}")


NO_SCENERY = Scenery()
NO_TRAFFIC = Traffic()
