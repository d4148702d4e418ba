"""The beginning of a map for the Walker, to which tests add behaviors."""

from __future__ import annotations

MAP_HEAD = """\
schema = 1
robot = "walker"
[policy]
name = "walker"
sha256 = ""
"""
