"""Robots by name. Importing this room loads no simulator."""

from pdtui.robots.environments.environment_lookup import trust_module
from pdtui.robots.options.robot_spec import RobotSpec
from pdtui.robots.robot_registry import (
    list_robot_names,
    list_robot_options,
    list_robots,
    make_robot,
    open_robot,
    require_robot_name,
    robot_file_stem,
)

__all__ = [
    "RobotSpec",
    "list_robot_names",
    "list_robot_options",
    "list_robots",
    "make_robot",
    "open_robot",
    "require_robot_name",
    "robot_file_stem",
    "trust_module",
]
