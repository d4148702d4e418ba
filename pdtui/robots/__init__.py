"""Robots by name. Importing this room loads no simulator."""

from __future__ import annotations

from pdtui.robots.registry import check_robot, file_stem, make_robot, open_robot, robot_names, trust_module

__all__ = ["check_robot", "file_stem", "make_robot", "open_robot", "robot_names", "trust_module"]
