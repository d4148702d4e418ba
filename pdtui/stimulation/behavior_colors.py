"""Colors of behaviors, the same on the screen and in the viewer."""

from __future__ import annotations

BEHAVIOR_COLORS = ("#f0a45d", "#58c4dc", "#b6e36b", "#e879c6", "#ffe07a", "#8ea8ff", "#5ee0b0", "#ff8a80")
"""By row in the map, modulo their number; they differ in lightness as well as in hue."""


def behavior_color_rgb(row: int) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of the behavior in a row of the map."""
    red, green, blue = bytes.fromhex(BEHAVIOR_COLORS[row % len(BEHAVIOR_COLORS)][1:])
    return red, green, blue
