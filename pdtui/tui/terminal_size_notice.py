"""What is shown instead of a drive that does not fit into the terminal."""

from __future__ import annotations

from textual.geometry import Size
from textual.strip import Strip
from textual.widget import Widget

from pdtui.tui.cell_text import ScreenRow
from pdtui.tui.theme import STYLES

LEAST_SIZE = Size(80, 24)
"""Columns and lines of the smallest terminal that shows a drive."""


class TerminalSizeNotice(Widget, can_focus=False):
    """Shows the needed and the present size instead of a drive that does not fit; the drive continues."""

    def render_line(self, y: int) -> Strip:
        """Render one line; the message is centered in the terminal."""
        (width, height), terminal = self.size, self.app.size
        lines = [
            ("terminal too small", STYLES.accent),
            (f"need {LEAST_SIZE.width} × {LEAST_SIZE.height}", STYLES.text),
            (f"have {terminal.width} × {terminal.height}", STYLES.warn),
            ("the drive continues", STYLES.muted),
        ]
        row = y - max(0, (height - len(lines)) // 2)
        if not 0 <= row < len(lines):
            return Strip.blank(width, STYLES.base)
        text, style = lines[row]
        line = ScreenRow(width).add(" " * max(0, (width - len(text)) // 2), style).add(text, style)
        return line.strip().apply_style(STYLES.base)
