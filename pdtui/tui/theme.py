"""The screen's only theme, and the styles of pictures and tables that are derived from it."""

from __future__ import annotations

from rich.style import Style
from textual.color import Color
from textual.theme import Theme

from pdtui.stimulation.behavior_colors import BEHAVIOR_COLORS

THEME = Theme(
    name="pdtui",
    primary="#6cb6d9",
    secondary="#8ea8ff",
    accent="#f0a45d",
    success="#84d39a",
    warning="#f2cc60",
    error="#f47c7c",
    foreground="#cdd6e0",
    background="#0c1016",
    surface="#10151d",
    panel="#18202b",
    dark=True,
)
_COLD, _WARM = Color.parse("#4aa3ff"), Color.parse("#ff9d4d")
HEAT_LEVELS = 8
_DEPTHS = ((0.0, 0.45), (0.0, 0.62), (0.0, 0.80), (0.03, 1.0), (0.16, 1.0))
"""From far to near: the lightening of the robot's colour, and its share in the blend with the background."""


_VARIABLES = THEME.to_color_system().generate()
_BACK, _FRONT, _MAIN, _SECOND, _ACCENT, _SUCCESS, _WARNING, _ERROR, _PANEL = (
    Color.parse(_VARIABLES[name])
    for name in (
        *("background", "foreground", "primary", "secondary", "accent"),
        *("success", "warning", "error", "panel"),
    )
)
_BEHAVIORS = tuple(Color.parse(color) for color in BEHAVIOR_COLORS)


def _style(color: Color, *, bold: bool = False, on: Color | None = None) -> Style:
    return Style(color=color.rich_color, bold=bold or None, bgcolor=None if on is None else on.rich_color)


def _heat(level: int) -> Color:
    share = (abs(level) / HEAT_LEVELS) ** 0.8
    return _BACK.blend(_PANEL, 0.8).blend(_WARM if level > 0 else _COLD, share)


class ThemeStyles:
    """The styles that are derived from the theme.

    Attributes:
        base: the background.
        text, muted, faint: three strengths of the foreground.
        title: titles and values.
        primary, accent, good, warn, bad: the theme's colours.
        alert: urgent messages.
        below: values below zero, where those above are `primary`.
        ghost: the ghost.
        obstacle: obstacles.
        key: cap of a key that is not latched.
        behaviors: colours of behaviors by row in the map, modulo their number.
        caps: key caps of latched behaviors, in the same order.
        depth: shades of the robot from far to near.
        heat: colours from −1 over 0 to +1, 2 × HEAT_LEVELS + 1 of them.
    """

    base = Style(bgcolor=_BACK.rich_color)
    text = _style(_FRONT)
    muted = _style(_BACK.blend(_FRONT, 0.58))
    faint = _style(_BACK.blend(_FRONT, 0.30))
    title = _style(_FRONT, bold=True)
    primary = _style(_MAIN)
    accent = _style(_ACCENT, bold=True)
    good = _style(_SUCCESS)
    warn = _style(_WARNING)
    bad = _style(_ERROR)
    alert = _style(_BACK, bold=True, on=_ERROR)
    below = _style(_BACK.blend(_MAIN, 0.6))
    ghost = _style(_BACK.blend(_SECOND, 0.6))
    obstacle = _style(_SUCCESS, bold=True)
    key = _style(_FRONT, bold=True, on=_BACK.blend(_FRONT, 0.16))
    behaviors = tuple(_style(color) for color in _BEHAVIORS)
    caps = tuple(_style(_BACK, bold=True, on=color) for color in _BEHAVIORS)
    depth = tuple(_style(_BACK.blend(_MAIN.lighten(light), share)) for light, share in _DEPTHS)
    heat = tuple(_heat(level) for level in range(-HEAT_LEVELS, HEAT_LEVELS + 1))

    def behavior(self, row: int) -> Style:
        """Return the colour of the behavior in a row of the map; faint for no behavior."""
        return self.faint if row < 0 else self.behaviors[row % len(self.behaviors)]


STYLES = ThemeStyles()
