"""The robots that pdtui knows, by name. Importing this room loads no simulator."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pdtui.errors import RobotError

if TYPE_CHECKING:
    from pdtui.robots.base import Robot

ROBOTS: dict[str, str] = {"ant": "pdtui.robots.ant:Ant"}


def check_robot(name: str) -> str:
    """Return the name of a known robot.

    Raises:
        RobotError: no robot has that name.
    """
    if name not in ROBOTS:
        raise RobotError(f"unknown robot '{name}'; there are {', '.join(sorted(ROBOTS))}")
    return name


def make_robot(name: str, **options: Any) -> Robot:
    """Build a robot in its own simulator.

    Raises:
        RobotError: no robot has that name, or what it needs is not installed.
    """
    module, _, attribute = ROBOTS[check_robot(name)].partition(":")
    try:
        robot: Robot = getattr(import_module(module), attribute)(**options)
    except ImportError as error:
        raise RobotError(f"robot '{name}' needs a package that is not installed: {error}") from error
    return robot
