"""The picture of a world without links, in the terminal's own graphics."""

from __future__ import annotations

from time import monotonic
from typing import Any

from PIL import Image
from textual.app import ComposeResult
from textual.containers import Container
from textual.reactive import reactive

from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.tui.graphics.terminal_graphics import MOST_PICTURES, TerminalGraphics


class GraphicsPane(Container):
    """Shows the newest picture, as large as the pane allows, a few times per second.

    Args:
        graphics: how the terminal shows pictures.
    """

    BORDER_TITLE = "world"
    DEFAULT_CSS = """
    GraphicsPane { align: center middle; width: 1fr; }
    GraphicsPane #world-image { width: auto; height: 100%; }
    GraphicsPane.-broad #world-image { width: 100%; height: auto; }
    """
    facts: reactive[DriveFacts | None] = reactive(None, init=False, repaint=False)
    snapshot: reactive[DriveSnapshot | None] = reactive(None, init=False, repaint=False, always_update=True)

    def __init__(self, graphics: TerminalGraphics, *, id: str) -> None:
        super().__init__(id=id)
        self._period = 1.0 / MOST_PICTURES[graphics.protocol]
        self._image: Any = graphics.widget(id="world-image")
        self._due = 0.0

    def compose(self) -> ComposeResult:
        yield self._image

    def watch_snapshot(self, snapshot: DriveSnapshot | None) -> None:
        now = monotonic()
        if snapshot is None or snapshot.picture is None or (now < self._due and snapshot.past is None):
            return
        self._due = now + self._period
        rows, columns = snapshot.picture.shape[:2]
        size = self.content_size
        # A cell is about twice as high as it is wide.
        self.set_class(columns * 2 * size.height > rows * size.width, "-broad")
        self._image.image = Image.fromarray(snapshot.picture)
