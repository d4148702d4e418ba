"""The time axis under plots, with the keys where they were pressed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from rich.cells import cell_len
from rich.style import Style

from pdtui.core.drive_edits import EDIT_KEY
from pdtui.driving.drive_snapshot import KeyPress
from pdtui.tui.cell_text import ScreenRow, displayed_key_name
from pdtui.tui.theme import STYLES

_KEPT = 500  # key presses
_SYMBOLS = {"space": "␣", EDIT_KEY: "◆"}


class KeyPressAxis:
    """The latest key presses, as marks on a time axis, in the colors of their behaviors."""

    def __init__(self) -> None:
        self._presses: deque[KeyPress] = deque(maxlen=_KEPT)

    def extend(self, presses: Iterable[KeyPress]) -> None:
        """Add key presses."""
        self._presses.extend(presses)

    def draw_axis(self, line: ScreenRow, cells: int, cell_of: Callable[[int], int]) -> None:
        """Add an axis of so many cells to a line; `cell_of` returns the cell of a control step."""
        marks: dict[int, tuple[str, Style]] = {}
        for press in self._presses:
            style = STYLES.title if press.behavior < 0 else STYLES.behavior(press.behavior)
            marks[cell_of(press.step)] = (key_symbol(press.key), style)
        blank = 0
        for cell in [*sorted(cell for cell in marks if 0 <= cell < cells), cells]:
            line.add("─" * (cell - blank), STYLES.faint)
            line.add(*marks.get(cell, ("", STYLES.faint)))
            blank = cell + 1


def key_symbol(key: str) -> str:
    """Return one cell that stands for a key."""
    name = _SYMBOLS.get(key) or displayed_key_name(key)
    return name if cell_len(name) == 1 else next((sign for sign in name if cell_len(sign) == 1), "·")
