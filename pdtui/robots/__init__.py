"""The robots that pdtui knows, by name. Importing this room loads no simulator."""

from __future__ import annotations

from pdtui.robots.registry import ROBOTS, check_robot, file_stem, make_robot, trust_module

__all__ = ["ROBOTS", "check_robot", "file_stem", "make_robot", "trust_module"]
