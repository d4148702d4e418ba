"""Uneven ground and trees, drawn from a random generator, without a simulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError

CELL = 0.25
"""Distance between neighboring heights, m."""
AHEAD = 60.0
"""Extent of rough ground and forest ahead of the start, m."""
_BEHIND, _BESIDE = 4.0, 10.0  # extent of rough ground behind the start and to each side, m
_CLEARING = 0.75  # radius of level ground around the start, m
_TRUNK_RADII = (0.15, 0.35)  # m
_MIN_GAP = 0.9  # between two trunks, m: wide enough for the robot
_FIRST_TREE = 2.5  # distance of the first tree from the start, m
_TRIES_PER_TREE = 30
_MAX_ROUGHNESS = 1.0  # m
_MAX_DENSITY = 1.0  # trees per square meter, more than find room


@dataclass(frozen=True)
class RoughGround:
    """Heights on a grid around the start, at (0, 0); the grid's edges are level with the plane around it.

    Attributes:
        heights: Heights, m, shape (X, Y), `CELL` apart.
        corner: x and y of the first height, m.
    """

    heights: Floats
    corner: tuple[float, float]

    @property
    def extent(self) -> tuple[float, float]:
        """Its length along x and along y, m."""
        rows, columns = self.heights.shape
        return (rows - 1) * CELL, (columns - 1) * CELL

    def height(self, x: float, y: float) -> float:
        """Return the height at a point, m: interpolated within the grid, 0 outside."""
        column, row = (x - self.corner[0]) / CELL, (y - self.corner[1]) / CELL
        i, j = int(np.floor(column)), int(np.floor(row))
        if not (0 <= i < self.heights.shape[0] - 1 and 0 <= j < self.heights.shape[1] - 1):
            return 0.0
        u, v = column - i, row - j
        (a, b), (c, d) = self.heights[i : i + 2, j : j + 2].tolist()
        return float((1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d))

    def heights_at(self, points: Floats) -> Floats:
        """Return the heights at points x y, m, shape (..., K) for points of shape (..., K, 2)."""
        return interpolate_heights(self.heights[None], np.zeros(1, np.intp), points, self.corner)


def interpolate_heights(
    grounds: Floats, which: NDArray[np.intp], points: Floats, corner: tuple[float, float]
) -> Floats:
    """Return the heights at points of each of n robots, on one of G grounds, as `RoughGround.height` does.

    Args:
        grounds: Heights of the grounds, m, shape (G, X, Y).
        which: Index of the ground of each robot, shape (n,).
        points: x and y, m, shape (n, K, 2).
        corner: x and y of the first height of every ground, m.
    """
    _, rows, columns = grounds.shape
    x, y = np.moveaxis((points - np.array(corner)) / CELL, -1, 0)
    i, j = np.floor(x), np.floor(y)
    u, v = x - i, y - j
    inside = (i >= 0) & (i < rows - 1) & (j >= 0) & (j < columns - 1)
    first = np.where(inside, i * columns + j, 0).astype(np.intp) + (which * (rows * columns))[:, None]
    flat = grounds.ravel()
    a, b, c, d = (flat.take(first + step) for step in (0, 1, columns, columns + 1))
    between = (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d)
    heights: Floats = np.where(inside, between, 0.0)
    return heights


def draw_rough_ground(rng: np.random.Generator, roughness: float) -> RoughGround:
    """Draw heights uniformly from 0 to `roughness` m, on 64 × 20 m; level where the robot starts.

    Raises:
        RobotError: The roughness is not from 0 to 1 m.
    """
    if not 0.0 <= roughness <= _MAX_ROUGHNESS:
        raise RobotError(f"expected a roughness of 0 to {_MAX_ROUGHNESS:g} m, found {roughness:g}")
    x = np.arange(-_BEHIND, AHEAD + CELL / 2, CELL)
    y = np.arange(-_BESIDE, _BESIDE + CELL / 2, CELL)
    heights = rng.uniform(0.0, roughness, (len(x), len(y)))
    heights[np.hypot(x[:, None], y[None, :]) < _CLEARING] = 0.0
    heights[[0, -1], :] = heights[:, [0, -1]] = 0.0
    return RoughGround(heights, (-_BEHIND, -_BESIDE))


def scatter_trees(rng: np.random.Generator, density: float) -> Floats:
    """Draw trees on the rough ground from 2.5 m ahead of the start on, at least 0.9 m apart.

    Args:
        rng: The random generator.
        density: Trees per square meter, as far as there is room.

    Returns:
        x, y and radius of each, m, shape (N, 3), sorted by x.

    Raises:
        RobotError: The density is not from 0 to 1 tree per square meter.
    """
    if not 0.0 <= density <= _MAX_DENSITY:
        raise RobotError(f"expected a density of 0 to {_MAX_DENSITY:g} trees per m², found {density:g}")
    low, high = np.array([_FIRST_TREE, -_BESIDE + 1.0]), np.array([AHEAD - 1.0, _BESIDE - 1.0])
    count = round(density * float(np.prod(high - low)))
    trees = np.empty((0, 3))
    for _ in range(_TRIES_PER_TREE * count):
        if len(trees) == count:
            break
        place, radius = rng.uniform(low, high), rng.uniform(*_TRUNK_RADII)
        if (np.hypot(*(trees[:, :2] - place).T) - trees[:, 2] - radius >= _MIN_GAP).all():
            trees = np.vstack([trees, [*place, radius]])
    return trees[np.argsort(trees[:, 0])]
