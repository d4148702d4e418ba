"""Robots by name. Importing this room loads no simulator."""

from pdtui.robots.robot_registry import (
    list_robot_names,
    make_robot,
    open_robot,
    require_robot_name,
    robot_file_stem,
    trust_module,
)

__all__ = [
    "list_robot_names",
    "make_robot",
    "open_robot",
    "require_robot_name",
    "robot_file_stem",
    "trust_module",
]
