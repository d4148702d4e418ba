"""A list that scrolls by the mouse wheel where not all of it has room."""

from __future__ import annotations

from pdtui.tui.snapshot_widget import SnapshotWidget


class ScrolledList(SnapshotWidget):
    """A widget that lists things one after the other, from one of them on.

    Painting it sets how many of them have no room, which is how far it scrolls.
    """

    _first = _hidden = 0  # what it is listed from, and how many have no room

    def on_mouse_scroll_down(self) -> None:
        self._first = min(self._first + 1, self._hidden)
        self.redraw()

    def on_mouse_scroll_up(self) -> None:
        self._first = max(self._first - 1, 0)
        self.redraw()
