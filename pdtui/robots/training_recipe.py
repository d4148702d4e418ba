"""How a robot's policy is trained, as plain data: `pdtui.training` reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class TrainingRecipe:
    """How a robot's policy is trained unless the command line says otherwise.

    Attributes:
        options: arguments of the robot's class while it trains.
        settings: changes to the algorithm's configuration; an algorithm ignores those that it does not have.
        world_batch: class that steps all worlds of a run at once, ``package.module:Class``, called with a
            robot, the number of worlds and a seed; where it is empty, every world is a robot of its own.
        initial_policy: name of the shipped policy that PPO begins from; empty for an untrained one.
    """

    options: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    world_batch: str = ""
    initial_policy: str = ""
