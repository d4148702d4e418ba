"""What the tests of worlds share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pdtui.robots.environments.gymnasium_spaces import action_to_vector
from pdtui.robots.robot import Robot


def random_actions(name: str, count: int, seed: int = 0) -> list[NDArray[np.float32]]:
    """Seeded actions of an environment, as a policy gives them."""
    env: gymnasium.Env[Any, Any] = gymnasium.make(name)
    env.action_space.seed(seed)
    return [action_to_vector(env.action_space, env.action_space.sample()) for _ in range(count)]


def follow(robot: Robot, actions: Iterable[NDArray[np.float32]]) -> list[tuple[Any, ...]]:
    """Everything that a robot shows while it takes the actions, bit for bit; what ended starts again."""
    seen = []
    for action in actions:
        observation, reward, terminated, truncated, _ = robot.step(action)
        attributes, poses = robot.read_attributes().tobytes(), robot.read_poses().tobytes()
        seen.append((robot.digest(), observation.tobytes(), reward, terminated, attributes, poses))
        if terminated or truncated:
            robot.reset()
    return seen


def values_of(robot: Robot) -> dict[str, float]:
    """Attributes by name."""
    names = [attribute.name for attribute in robot.attributes]
    return dict(zip(names, robot.read_attributes().tolist(), strict=True))
