"""Text that fits into terminal cells: padding, short numbers and key names."""

from __future__ import annotations

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment
from rich.style import Style
from textual.keys import format_key
from textual.strip import Strip

from pdtui.core.printable_text import make_printable


def measure_cell_width(text: str) -> int:
    """Return the number of cells of printable text."""
    return len(text) if text.isascii() else cell_len(text)


def fit_cells(text: str, width: int) -> str:
    """Pad text on the right, or cut it with an ellipsis, to exactly `width` cells."""
    if width <= 0:
        return ""
    length = measure_cell_width(text)
    if length <= width:
        return text + " " * (width - length)
    return set_cell_size(set_cell_size(text, width - 1).rstrip() + "…", width)


def format_number(value: float) -> str:
    """Format a number in at most 7 characters, with a true minus sign."""
    size = abs(value)
    digits = 2 if size < 100 else 1 if size < 1000 else 0
    shown = f"{value:.{digits}f}" if size < 99999.5 else f"{value:.0e}".replace("e+0", "e")
    if float(shown) == 0.0:
        shown = shown.lstrip("-")
    return shown.replace("-", "−")


def format_signed(value: float) -> str:
    """Format a number as `format_number` does, but always with a sign."""
    shown = format_number(value)
    return shown if shown.startswith("−") else f"+{shown}"


def displayed_key_name(key: str) -> str:
    """Return the name under which the screen shows a key."""
    return make_printable(format_key(key))


class ScreenRow:
    """One line of the screen, assembled from the left."""

    def __init__(self, width: int) -> None:
        self.width, self.left = width, width
        self._segments: list[Segment] = []

    def add(self, text: str, style: Style, width: int | None = None, *, right: bool = False) -> ScreenRow:
        """Append text, fitted to `width` cells if given; what exceeds the line is cut."""
        length = measure_cell_width(text)
        if width is not None and length != width:
            text = " " * (width - length) + text if right and length < width else fit_cells(text, width)
            length = max(width, 0)
        if length > self.left:
            text, length = fit_cells(text, self.left), self.left
        if text:
            self._segments.append(Segment(text, style))
            self.left -= length
        return self

    def add_strip(self, strip: Strip) -> ScreenRow:
        """Append a line, which is cut where it exceeds this one."""
        strip = strip if strip.cell_length <= self.left else strip.crop(0, self.left)
        self._segments += strip
        self.left -= strip.cell_length
        return self

    def strip(self) -> Strip:
        """Return the line, padded with blanks."""
        if self.left:
            self._segments.append(Segment(" " * self.left))
            self.left = 0
        return Strip(self._segments, self.width)
