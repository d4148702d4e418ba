"""The color of a behavior, the same on the screen and in the viewer."""

from __future__ import annotations

BEHAVIOR_COLORS = (
    "#f0a45d",
    "#58c4dc",
    "#b6e36b",
    "#e879c6",
    "#ffe07a",
    "#8ea8ff",
    "#5ee0b0",
    "#ff8a80",
)
"""Told apart by lightness as well as by hue; a behavior has its row in the map, modulo their number."""


def behavior_rgb(row: int) -> tuple[int, int, int]:
    """Color of the behavior in this row of the map: red, green, blue of 0 to 255."""
    red, green, blue = bytes.fromhex(BEHAVIOR_COLORS[row % len(BEHAVIOR_COLORS)][1:])
    return red, green, blue
