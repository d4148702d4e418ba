"""The notice shown instead of the drive in a terminal that is too small."""

from __future__ import annotations

from textual.geometry import Size
from textual.strip import Strip
from textual.widget import Widget

from pdtui.tui.cell_text import ScreenRow
from pdtui.tui.theme import theme_styles

LEAST = Size(80, 24)


def is_too_small(size: Size) -> bool:
    """Return whether the drive's screen does not fit."""
    return size.width < LEAST.width or size.height < LEAST.height


class TerminalSizeNotice(Widget, can_focus=False):
    """Shows the needed and the present size; the drive continues meanwhile."""

    def render_line(self, y: int) -> Strip:
        """Render one line; the message is centred in the terminal."""
        palette, (width, height) = theme_styles(self.app.theme_variables), self.size
        lines = [
            ("terminal too small", palette.accent),
            (f"need {LEAST.width} × {LEAST.height}", palette.text),
            (f"have {self.app.size.width} × {self.app.size.height}", palette.warn),
            ("the drive continues", palette.muted),
        ]
        row = y - max(0, (height - len(lines)) // 2)
        if not 0 <= row < len(lines):
            return Strip.blank(width, palette.base)
        text, style = lines[row]
        return (
            ScreenRow(width)
            .add(" " * max(0, (width - len(text)) // 2), style)
            .add(text, style)
            .strip()
            .apply_style(palette.base)
        )
