"""The base of the screen's widgets: lines painted from the newest snapshot."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self, TypeVar

from rich.segment import Segment
from rich.style import Style
from textual.color import Color
from textual.filter import ANSIToTruecolor
from textual.geometry import Region, Size
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

if TYPE_CHECKING:
    from textual import events
    from textual.theme import Theme

    from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
    from pdtui.stimulation.stimulation_map import StimulationMap


Sides = tuple[Strip, Strip, Color, Style]
_MOST_STYLES = 4096  # that a widget remembers
LEAST_PAINTED = Size(16, 2)
"""Columns and lines of the smallest picture that is painted; a smaller widget shows its upper left part."""


Shown = TypeVar("Shown")


class UncomputedReactive(reactive[Shown]):
    """A reactive that is cheap to read: Textual's own looks for a method that computes it each time."""

    if not TYPE_CHECKING:

        def __get__(self, owner, owner_type=None):
            if owner is None:
                return self
            try:
                return vars(owner)[self.internal_name]
            except KeyError:  # not set yet
                return super().__get__(owner, owner_type)


class SnapshotWidget(Widget, can_focus=False, inherit_bindings=False):
    """Paints whole lines, repaints only those that changed, and never changes the layout.

    A terminal may have any size, and a widget without room gets none. So `paint` is never asked for less than
    `LEAST_PAINTED`, and what does not fit is cut off.
    """

    ALLOW_SELECT: ClassVar[bool] = False
    facts: reactive[DriveFacts | None] = UncomputedReactive(
        None, init=False, repaint=False, always_update=True
    )
    snapshot: reactive[DriveSnapshot | None] = UncomputedReactive(
        None, init=False, repaint=False, always_update=True
    )

    def __init__(self, stimulation_map: StimulationMap, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.map = stimulation_map
        self._strips: list[Strip] = []
        self._framed: list[Strip | None] = []
        self._painted_size = Size(0, 0)
        self._sides: Sides | None = None
        self._based: dict[int, tuple[Style | None, Style]] = {}
        self._borders: dict[int, Strip] = {}
        self.forget()

    @abstractmethod
    def paint(self, width: int, height: int) -> list[Strip]:
        """Return the lines of the widget as it is now, each `width` cells long; missing lines are blank.

        Neither size is less than that of `LEAST_PAINTED`.
        """

    def remember(self, snapshot: DriveSnapshot) -> None:
        """Keep what later frames need of a snapshot; called once per snapshot."""
        del snapshot

    def on_mount(self) -> None:
        self.app.theme_changed_signal.subscribe(self, self._adopt_theme)

    def _adopt_theme(self, _theme: Theme) -> None:
        self._painted_size = Size(0, 0)
        self.redraw()

    def handle_request(self, request: str) -> None:
        """Do what a key asks of this pane."""

    def forget(self) -> None:
        """Drop what was kept of snapshots, as another run begins."""

    def watch_facts(self, old: DriveFacts | None, facts: DriveFacts | None) -> None:
        if old is not None and facts is not None and old.branches != facts.branches:
            self.forget()
        self.redraw()

    def watch_snapshot(self, snapshot: DriveSnapshot | None) -> None:
        if snapshot is not None:
            self.remember(snapshot)
        self.redraw()

    def on_resize(self, _event: events.Resize) -> None:
        self.redraw()

    def redraw(self) -> None:
        """Paint, and have Textual repaint the lines that changed."""
        if not self.is_attached:
            return
        old, old_size = self._strips, self._painted_size
        self._paint_strips()
        if self._painted_size != old_size:
            self.refresh()
            return
        changed = [row for row, strip in enumerate(self._strips) if strip != old[row]]
        for row in changed:
            self._framed[row] = None
        if changed:
            # Textual would cut lines that are repaired without their frame.
            left, width = -self.gutter.left, self.outer_size.width
            self.refresh(*(Region(left, row, width, 1) for row in changed))

    def refresh(
        self, *regions: Region, repaint: bool = True, layout: bool = False, recompose: bool = False
    ) -> Self:
        """Have Textual repaint some lines, or all of them, as where the title has changed."""
        if not regions:
            self._borders = {}
        return super().refresh(*regions, repaint=repaint, layout=layout, recompose=recompose)

    def _paint_strips(self) -> None:
        """Paint lines for the present size; framed lines of another size are dropped."""
        width, height = size = self.content_size
        strips: list[Strip] = []
        if width > 0 and height > 0:
            wide, high = max(width, LEAST_PAINTED.width), max(height, LEAST_PAINTED.height)
            strips = self.paint(wide, high)[:height]
            strips += [Strip.blank(wide)] * (height - len(strips))
            if wide > width:
                strips = [strip.crop(0, width) for strip in strips]
        if size != self._painted_size:
            self._framed, self._sides, self._borders = [None] * len(strips), None, {}
        self._strips, self._painted_size = strips, size

    def notify_style_update(self) -> None:
        """Drop what was painted with the old styles."""
        super().notify_style_update()
        self._sides, self._borders = None, {}
        self._framed = [None] * len(self._framed)

    def render_line(self, y: int) -> Strip:
        """Render an empty line, around which Textual draws the frame; see `render_lines`."""
        del y
        # Styled, because Textual's filter for NO_COLOR fails on segments without a style.
        return Strip.blank(self.content_size.width, Style(bgcolor=self.background_colors[1].rich_color))

    def render_lines(self, crop: Region) -> list[Strip]:
        """Render the lines of the widget with its frame.

        Textual's own method resolves border, padding and background again for every changed line, which costs
        as much as painting it, and asks for all lines of a widget of which one changed. Here one empty line
        provides the sides of all, and the lines above and below are kept.
        """
        if self._painted_size != self.content_size:
            self._paint_strips()  # Textual may want lines of a new size before it tells the widget
        width = self.outer_size.width
        top, bottom = self.gutter.top, self.gutter.top + len(self._framed)
        lines: list[Strip] = []
        for y in crop.line_range:
            if top <= y < bottom:
                lines.append(self._frame_line(y - top))
            else:
                if y not in self._borders:
                    self._borders[y] = super().render_lines(Region(0, y, width, 1))[0]
                lines.append(self._borders[y])
        if crop.column_span != (0, width):
            lines = [line.crop(*crop.column_span) for line in lines]
        return lines

    def _frame_line(self, row: int) -> Strip:
        """Return a painted line between the sides of the frame, on the widget's background."""
        framed = self._framed[row]
        if framed is None:
            left, right, background, base = self._sides or self._make_sides()
            if len(self._based) > _MOST_STYLES:
                self._based.clear()
            known = self._based.get
            segments = [
                segment
                if (based := known(id(segment.style)) or self._add_base(segment.style, base))[1]
                is segment.style
                else Segment(segment.text, based[1])
                for segment in self._strips[row]
            ]
            # All colors are true colors already; other filters, such as NO_COLOR's, still apply.
            filters = [one for one in self.get_line_filters() if not isinstance(one, ANSIToTruecolor)]
            for line_filter in filters:
                segments = list(Strip(segments).apply_filter(line_filter, background))
            framed = self._framed[row] = Strip([*left, *segments, *right], self.outer_size.width)
        return framed

    def _add_base(self, style: Style | None, base: Style) -> tuple[Style | None, Style]:
        """Remember a style on the widget's background, and the style itself, so that its id stays its own."""
        own = style if style is not None and style.bgcolor is not None else base + style
        self._based[id(style)] = style, own
        return style, own

    def _make_sides(self) -> Sides:
        width, gutter = self.outer_size.width, self.gutter
        (line,) = super().render_lines(Region(0, gutter.top, width, 1))
        background = self.background_colors[1]
        self._based = {}
        self._sides = (
            line.crop(0, gutter.left),
            line.crop(width - gutter.right, width),
            background,
            Style(bgcolor=background.rich_color),
        )
        return self._sides

    def row_of(self, name: str) -> int:
        """Return the row of a behavior in the map, or −1 if the map does not have it."""
        return list(self.map.behaviors).index(name) if name in self.map.behaviors else -1
