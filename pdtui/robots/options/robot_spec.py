"""A robot by name, with its options: what a process needs in order to build it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pdtui.robots.options.robot_option import OptionValue


@dataclass(frozen=True)
class RobotSpec:
    """A robot that is not built yet, as plain data.

    Attributes:
        name: Name of the robot.
        options: Values of its options by name; what is left out has its default.
    """

    name: str
    options: Mapping[str, OptionValue] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.name
