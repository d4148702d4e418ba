"""What every part of the screen is: lines that are painted from the newest snapshot."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from textual.geometry import Region
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from pdtui.tui.palette import Palette, palette_of

if TYPE_CHECKING:
    from textual import events

    from pdtui.stimulation.maps import StimulationMap
    from pdtui.teleop.snapshot import Briefing, Snapshot


class Panel(Widget, can_focus=False, inherit_bindings=False):
    """Paints whole lines and repaints only those that changed, without ever touching the layout.

    Args:
        stimulation_map: the behaviors of the drive.
        id: for the style sheet.
    """

    ALLOW_SELECT: ClassVar[bool] = False
    briefing: reactive[Briefing | None] = reactive(None, init=False, repaint=False, always_update=True)
    snapshot: reactive[Snapshot | None] = reactive(None, init=False, repaint=False, always_update=True)

    def __init__(self, stimulation_map: StimulationMap, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.map = stimulation_map
        self._strips: list[Strip] = []

    @abstractmethod
    def paint(self, width: int, height: int) -> list[Strip]:
        """The lines of the panel as it is now; missing ones are blank."""

    def remember(self, snapshot: Snapshot) -> None:
        """Keep what later frames need of this snapshot; called once for each."""
        del snapshot

    @property
    def palette(self) -> Palette:
        """Styles of the present theme."""
        return palette_of(self.app.theme_variables)

    def watch_briefing(self) -> None:
        """Robot and policy are loaded."""
        self.redraw()

    def watch_snapshot(self, snapshot: Snapshot | None) -> None:
        """A newer picture of the drive has come."""
        if snapshot is not None:
            self.remember(snapshot)
        self.redraw()

    def on_resize(self, _event: events.Resize) -> None:
        """Paint for the new size."""
        self.redraw()

    def redraw(self) -> None:
        """Paint, and ask for a repaint of the lines that differ from those on the screen."""
        width, height = self.content_size
        if not self.is_attached or width <= 0 or height <= 0:
            return
        strips = self.paint(width, height)[:height]
        old, self._strips = self._strips, strips
        if len(old) != len(strips) or (old and old[0].cell_length != strips[0].cell_length):
            self.refresh()
            return
        changed = [row for row, strip in enumerate(strips) if strip != old[row]]
        if changed:
            self.refresh(*(Region(0, row, width, 1) for row in changed))

    def render_line(self, y: int) -> Strip:
        """One painted line."""
        base = self.palette.base
        if y < len(self._strips):
            return self._strips[y].apply_style(base)
        return Strip.blank(self.content_size.width, base)

    def row_of(self, name: str) -> int:
        """Row of a behavior in the map, −1 for one that the map does not have."""
        return list(self.map.behaviors).index(name) if name in self.map.behaviors else -1
