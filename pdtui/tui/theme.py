"""The theme and the styles of pictures and tables derived from it."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class ThemeStyles:
    """The styles of a theme.

    Attributes:
        base: the background.
        text, muted, faint: three strengths of the foreground.
        title: titles and values.
        primary, accent, good, warn, bad: the theme's colours.
        alert: urgent messages.
        obstacle: obstacles.
        key: cap of a key that is not latched.
        behaviors: colours of behaviors by row in the map, modulo their number.
        caps: key caps of latched behaviors, in the same order.
        depth: shades of the robot from far to near.
        heat: colours from −1 over 0 to +1, 2 × HEAT_LEVELS + 1 of them.
    """

    base: Style
    text: Style
    muted: Style
    faint: Style
    title: Style
    primary: Style
    accent: Style
    good: Style
    warn: Style
    bad: Style
    alert: Style
    obstacle: Style
    key: Style
    behaviors: tuple[Style, ...]
    caps: tuple[Style, ...]
    depth: tuple[Style, ...]
    heat: tuple[Color, ...]

    def behavior(self, row: int) -> Style:
        """Return the colour of the behavior in a row of the map; faint for no behavior."""
        return self.faint if row < 0 else self.behaviors[row % len(self.behaviors)]


def _derive_styles(theme: Theme) -> ThemeStyles:
    variables = theme.to_color_system().generate()
    names = ("background", "foreground", "primary", "accent", "success", "warning", "error", "panel")
    back, front, main, accent, success, warning, error, panel = (
        Color.parse(variables[name]) for name in names
    )
    colors = [Color.parse(color) for color in BEHAVIOR_COLORS]
    zero = back.blend(panel, 0.8)

    def style(color: Color, *, bold: bool = False, on: Color | None = None) -> Style:
        return Style(color=color.rich_color, bold=bold or None, bgcolor=None if on is None else on.rich_color)

    def heat(level: int) -> Color:
        share = (abs(level) / HEAT_LEVELS) ** 0.8
        return zero.blend(_WARM if level > 0 else _COLD, share)

    return ThemeStyles(
        base=Style(bgcolor=back.rich_color),
        text=style(front),
        muted=style(back.blend(front, 0.58)),
        faint=style(back.blend(front, 0.30)),
        title=style(front, bold=True),
        primary=style(main),
        accent=style(accent, bold=True),
        good=style(success),
        warn=style(warning),
        bad=style(error),
        alert=style(back, bold=True, on=error),
        obstacle=style(success, bold=True),
        key=style(front, bold=True, on=back.blend(front, 0.16)),
        behaviors=tuple(style(color) for color in colors),
        caps=tuple(style(back, bold=True, on=color) for color in colors),
        depth=tuple(style(back.blend(main.lighten(light), share)) for light, share in _DEPTHS),
        heat=tuple(heat(level) for level in range(-HEAT_LEVELS, HEAT_LEVELS + 1)),
    )


STYLES = _derive_styles(THEME)
"""The styles of the screen's only theme."""
