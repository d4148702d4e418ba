"""The Unitree A1 with a depth camera, for comparison with the one that does not see."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import gymnasium
import numpy as np

from pdtui.core.attributes import Floats
from pdtui.robots.a1 import A1

# Angles of the camera's rays (rad), its distance from the robot's center and the range of its sight (m).
_RAYS = np.radians(np.linspace(60.0, -60.0, 32))
_NOSE, _SIGHT = 0.25, 5.0


def observe_trees_along_rays(
    position: tuple[float, float], yaw: float, trees: Floats, fan: Floats, reach: float
) -> Floats:
    """Return how near the next tree trunk is along each ray: 1 at the camera, 0 from `reach` on.

    Args:
        position: x and y of the camera, m.
        yaw: Direction in which the camera looks, rad.
        trees: x, y and radius of each trunk, m, shape (N, 3).
        fan: Angles of the rays from that direction, positive to the left, rad, shape (R,).
        reach: Range of the camera, m.

    Returns:
        1 − distance / reach, shape (R,).
    """
    offsets = trees[:, :2] - np.array(position)
    close = np.hypot(*offsets.T) - trees[:, 2] < reach
    offsets, radii = offsets[close], trees[close, 2]
    rays = np.stack([np.cos(yaw + fan), np.sin(yaw + fan)])
    along = offsets @ rays  # shape (trees, rays): where along the ray the trunk is nearest to it
    beside = offsets[:, [1]] * rays[0] - offsets[:, [0]] * rays[1]
    half_chord = radii[:, None] ** 2 - beside**2
    hit = (half_chord >= 0.0) & (along > 0.0)
    distance = np.where(hit, along - np.sqrt(np.maximum(half_chord, 0.0)), reach)
    nearness: Floats = 1.0 - np.clip(distance.min(axis=0, initial=reach), 0.0, reach) / reach
    return nearness


class A1Vision(A1):
    """The A1 with a depth camera of one row, held level at its nose.

    The observation (125) holds the A1's, then, for 32 rays from 60° on the left to 60° on the right, how near
    the next tree trunk is: 1 at the camera and 0 from 5 m on. Everything else is the A1's.
    """

    name = "a1-vision"
    title = "Unitree A1 with a depth camera (PyBullet)"
    needed_package = "pybullet"
    tasks = ()
    training_recipe = replace(
        A1.training_recipe,
        options={**A1.training_recipe.options, "terrain": "forest"},
        settings={**A1.training_recipe.settings, "learning_rate": 1e-4},
        initial_policy="a1",
    )

    def __init__(self, terrain: Literal["plane", "rough", "forest"] = "forest", **options: float) -> None:
        super().__init__(terrain, **options)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (93 + len(_RAYS),), np.float64)

    def observe(self) -> Floats:
        (x, y, _), yaw = self._base()[0], self._attitude()[2]
        nose = (x + _NOSE * math.cos(yaw), y + _NOSE * math.sin(yaw))
        return np.concatenate(
            [super().observe(), observe_trees_along_rays(nose, yaw, self.scenery.cylinders, _RAYS, _SIGHT)]
        )
