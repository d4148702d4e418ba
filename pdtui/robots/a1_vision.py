"""The Unitree A1 with a depth camera, for comparison with the blind one."""

from __future__ import annotations

import math
from dataclasses import replace

import gymnasium
import numpy as np

from pdtui.core.attributes import Floats
from pdtui.robots.a1 import A1
from pdtui.robots.legged.tree_rays import tree_nearness

_FAN = np.radians(np.linspace(60.0, -60.0, 32))
_NOSE, _SIGHT = 0.25, 5.0


class A1Vision(A1):
    """The A1 with a depth camera of one row, held level at its nose: for comparison, it sees the trees.

    Observation (125): the A1's, then for 32 rays from 60° on the left to 60° on the right how near the next
    trunk is, 1 at the camera and 0 from 5 m on. Everything else is the A1's.
    """

    name = "a1-vision"
    title = "Unitree A1 with a depth camera (PyBullet)"
    tasks = ()
    training_recipe = replace(
        A1.training_recipe,
        options={**A1.training_recipe.options, "terrain": "forest"},
        settings={**A1.training_recipe.settings, "learning_rate": 1e-4},
        initial_policy="a1",
    )

    def __init__(self, terrain: str = "forest", **options: float) -> None:
        super().__init__(terrain, **options)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (93 + len(_FAN),), np.float64)

    def observe(self) -> Floats:
        (x, y, _), yaw = self._base()[0], self._attitude()[2]
        nose = (x + _NOSE * math.cos(yaw), y + _NOSE * math.sin(yaw))
        return np.concatenate([super().observe(), tree_nearness(nose, yaw, self.obstacles, _FAN, _SIGHT)])
