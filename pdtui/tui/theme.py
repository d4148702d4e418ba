"""pdtui's own theme, and the styles of pictures and tables that are derived from the theme in use."""

from __future__ import annotations

from rich.style import Style
from textual.color import Color
from textual.theme import Theme

from pdtui.stimulation.behavior_colors import BEHAVIOR_COLORS
from pdtui.tui.themes.legible_colors import MARK_CONTRAST, TEXT_CONTRAST, make_legible

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
_DEEP_COLD, _DEEP_WARM = Color.parse("#0b5cc4"), Color.parse("#c24e00")  # on a light background
HEAT_LEVELS = 8
_DEPTHS = ((0.0, 0.45), (0.0, 0.62), (0.0, 0.80), (0.03, 1.0), (0.16, 1.0))
"""From far to near: the lightening of the robot's color, and its share in the blend with the background."""
_MUTED, _FAINT = 4.2, 2.0  # least contrasts of secondary text and of scales


def _style(color: Color, *, bold: bool = False, on: Color | None = None) -> Style:
    return Style(color=color.rich_color, bold=bold or None, bgcolor=None if on is None else on.rich_color)


class ThemeStyles:
    """The styles that are derived from the theme in use; read them when painting, as they change with it.

    Attributes:
        base: the background.
        text, muted, faint: three strengths of the foreground.
        title: titles and values.
        primary, accent, good, warn, bad: the theme's colors.
        alert: urgent messages.
        below: values below zero, where those above are `primary`.
        ghost: the ghost.
        obstacle: obstacles.
        key: cap of a key that is not latched.
        behaviors: colors of behaviors by row in the map, modulo their number.
        caps: key caps of latched behaviors, in the same order.
        depth: shades of the robot from far to near.
        heat: colors from −1 over 0 to +1, 2 × HEAT_LEVELS + 1 of them.
    """

    def __init__(self, theme: Theme) -> None:
        self.adopt(theme)

    def adopt(self, theme: Theme) -> None:
        """Derive all styles from a theme, with colors that can be read on its background."""
        variables = theme.to_color_system().generate()
        back = Color.parse(variables["background"])

        def color(name: str, contrast: float = TEXT_CONTRAST) -> Color:
            # Text may be a blend with the background's own "auto" color; the foreground is never.
            return make_legible(Color.parse(variables[name]), back, contrast)

        front, main, second, success = (
            color(name) for name in ("foreground", "primary", "secondary", "success")
        )
        error, panel = color("error"), Color.parse(variables["panel"])
        behaviors = tuple(make_legible(Color.parse(text), back) for text in BEHAVIOR_COLORS)
        cap = back.blend(front, 0.16)
        self.base = Style(bgcolor=back.rich_color)
        self.text = _style(front)
        self.muted = _style(make_legible(back.blend(front, 0.58), back, _MUTED))
        self.faint = _style(make_legible(back.blend(front, 0.30), back, _FAINT))
        self.title = _style(front, bold=True)
        self.primary = _style(main)
        self.accent = _style(color("accent"), bold=True)
        self.good = _style(success)
        self.warn = _style(color("warning"))
        self.bad = _style(error)
        self.alert = _style(back, bold=True, on=error)
        self.below = _style(make_legible(back.blend(main, 0.6), back, MARK_CONTRAST))
        self.ghost = _style(make_legible(back.blend(second, 0.6), back, MARK_CONTRAST))
        self.obstacle = _style(success, bold=True)
        self.key = _style(make_legible(front, cap), bold=True, on=cap)
        self.behaviors = tuple(_style(one) for one in behaviors)
        self.caps = tuple(_style(back, bold=True, on=one) for one in behaviors)
        # Near is far from the background: lighter in the dark, darker in the light.
        near = main.lighten if theme.dark else main.darken
        self.depth = tuple(_style(back.blend(near(change), share)) for change, share in _DEPTHS)
        zero = back.blend(panel, 0.8)
        cold, warm = (_COLD, _WARM) if theme.dark else (_DEEP_COLD, _DEEP_WARM)
        self.heat = tuple(
            zero.blend(warm if level > 0 else cold, (abs(level) / HEAT_LEVELS) ** 0.8)
            for level in range(-HEAT_LEVELS, HEAT_LEVELS + 1)
        )

    def behavior(self, row: int) -> Style:
        """Return the color of the behavior in a row of the map; faint for no behavior."""
        return self.faint if row < 0 else self.behaviors[row % len(self.behaviors)]


STYLES = ThemeStyles(THEME)
