"""How the policy of a robot is trained by default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class TrainingRecipe:
    """How a robot's policy is trained unless the command line says otherwise; `pdtui.training` reads it.

    Attributes:
        options: Arguments of the robot's class during training.
        settings: Changes to the algorithm's configuration. Settings that an algorithm lacks are ignored.
        sac_settings: Further changes where the algorithm is SAC.
        robot_batch: Class that steps all robots of a run at once, ``package.module:Class``, called with a
            robot, the number of robots and a seed. If it is empty, robots are stepped one by one.
        initial_policy: Name of the shipped policy that PPO starts from; empty for an untrained one.
    """

    options: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    sac_settings: Mapping[str, Any] = field(default_factory=dict)
    robot_batch: str = ""
    initial_policy: str = ""
