"""A world that is never twice the same, so that no other process can go on from its state."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

NAME = "tests.driving.ghost.wandering_world:pdtui-test/Wandering-v0"
"""The name under which any process makes it."""


class WanderingWorld(gymnasium.Env[NDArray[np.float64], NDArray[np.float32]]):
    """Three numbers that nobody has seeded."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float64)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        return np.zeros(3), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        del action
        return np.random.default_rng().random(3), 0.0, False, False, {}


gymnasium.register("pdtui-test/Wandering-v0", lambda **_: WanderingWorld())
