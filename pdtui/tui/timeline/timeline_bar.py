"""The bar of the run's time, on which keys and mouse choose the moment that is shown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.style import Style
from textual.strip import Strip

from pdtui.tui.cell_text import ScreenRow, displayed_key_name
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES
from pdtui.tui.timeline.timeline_marks import TimelineMarks

if TYPE_CHECKING:
    from textual import events

    from pdtui.driving.drive_client import DriveConnection
    from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
    from pdtui.stimulation.stimulation_map import StimulationMap

ARROW_REQUESTS = {"left": "back", "right": "forward", "up": "earlier mark", "down": "later mark"}
"""What the arrows do where they can move no target: in the past, and while a recording is watched."""
_HINTS = (
    (("seek_back", "seek_forward"), "seek"),
    (("pause",), "play"),
    (("seek_last",), "present"),
    (("branch",), "branch off here"),
)
_LABEL = 10  # width of the times at both ends, cells
_PATIENCE = 4  # snapshots within which the drive shows what was asked for, or something else instead


def describe_past_keys(keys: Mapping[str, tuple[str, str]]) -> str:
    """Return what can be done while the past is shown; keys with their descriptions by id of the binding."""
    said = []
    for names, says in _HINTS:
        known = [displayed_key_name(keys[name][0]) for name in names if name in keys]
        said += [" ".join([*known, says])] if known else []
    return "  ".join(said)


class TimelineBar(SnapshotWidget):
    """Shows the whole run from left to right, with its keys and endings, and the moment that is shown.

    What can no longer be looked at is dotted; what a recording is known to bring is thin.
    """

    def __init__(
        self, stimulation_map: StimulationMap, connection: DriveConnection, *, id: str | None = None
    ) -> None:
        super().__init__(stimulation_map, id=id)
        self._connection = connection

    def forget(self) -> None:
        self._marks = TimelineMarks()
        self._asked: int | None = None
        self._waited = 0
        self._dragging = False

    def watch_facts(self, old: DriveFacts | None, facts: DriveFacts | None) -> None:
        super().watch_facts(old, facts)
        if facts is not None and facts.length:
            self._marks = TimelineMarks()
            self._marks.add(facts.known_keys, facts.known_ends)

    def remember(self, snapshot: DriveSnapshot) -> None:
        if self.facts is None or not self.facts.length:
            self._marks.add(snapshot.key_presses, snapshot.ends)
        self._waited += 1
        if self._asked == snapshot.step or self._waited > _PATIENCE:
            self._asked = None
        # Where there is little room, the bar takes some only while it is of use.
        watching = self.facts is not None and self.facts.length > 0
        self.screen.set_class(snapshot.paused or snapshot.past is not None or watching, "-timeline")

    @property
    def moment(self) -> int:
        """The moment that is shown, or was asked for: the number of control steps done."""
        return self._asked if self._asked is not None else 0 if self.snapshot is None else self.snapshot.step

    @property
    def present(self) -> int:
        """The number of control steps that the run has done."""
        if self.snapshot is None:
            return 0
        return self.snapshot.step if self.snapshot.past is None else self.snapshot.past.present

    @property
    def last(self) -> int:
        """The last moment that can be shown: the present, or the end of a recording that is watched."""
        length = 0 if self.facts is None else self.facts.length
        return max(self.present, length)

    @property
    def is_open(self) -> bool:
        """Whether a drive is shown as it was, and not as it is."""
        watching = self.facts is not None and self.facts.length > 0
        return not watching and self.snapshot is not None and self.snapshot.past is not None

    def leave(self) -> None:
        """Return to the present."""
        self.seek(self.last)

    def seek(self, moment: int) -> None:
        """Ask for a moment, which the bar shows at once."""
        wanted = min(max(moment, 1), max(self.last, 1))
        shown = self._asked is None and self.snapshot is not None and self.snapshot.past is None
        if self.snapshot is None or (shown and wanted == self.moment):
            return  # what is shown already does not pause the drive
        self._asked, self._waited = wanted, 0
        self._connection.seek(wanted)
        self.redraw()

    def handle_request(self, request: str) -> None:
        """Ask for another moment than the one that is shown, or for a branch from there."""
        second = 1 if self.facts is None else max(1, round(1.0 / self.facts.dt))
        match request:
            case "back" | "forward":
                self.seek(self.moment + (second if request == "forward" else -second))
            case "earlier mark" | "later mark":
                later = request == "later mark"
                found = self._marks.next_to(self.moment, 1 if later else -1)
                self.seek(found if found is not None else self.last if later else 0)
            case "oldest":
                self.seek(0)
            case "last":
                self.seek(self.last)
            case "branch":
                self._connection.branch()

    def takes_key(self, key: str) -> bool:
        """Seek by an arrow where it can move no target; return whether the key was one."""
        past = self.snapshot is not None and self.snapshot.past is not None
        watching = self.facts is not None and self.facts.length > 0
        if (past or watching) and key in ARROW_REQUESTS:
            self.handle_request(ARROW_REQUESTS[key])
            return True
        return False

    def paint(self, width: int, height: int) -> list[Strip]:
        del height
        cells = width - 2 * _LABEL
        if self.facts is None or self.snapshot is None or cells < 1:
            return []
        past = self.snapshot.past
        oldest = 0 if past is None else past.oldest
        row = ScreenRow(width).add(f" {self._format(self.moment)} ", STYLES.text, _LABEL, right=True)
        signs = self._bases(cells, oldest)
        ranks, last = [-1] * cells, self.last
        for mark in self._marks:
            cell = _find_cell(mark.moment, last, cells)
            if mark.rank >= ranks[cell]:
                signs[cell], ranks[cell] = (mark.sign, mark.style), mark.rank
        at = _find_cell(self.moment, last, cells)
        signs[at] = ("●" if past is None and self._asked is None else "◆", STYLES.accent)
        run, style = "", signs[0][1]
        for sign, own in signs:
            if own is not style:
                row.add(run, style)
                run, style = "", own
            run += sign
        row.add(run, style)
        return [row.add(f" {self._format(last)}", STYLES.muted).strip()]

    def _bases(self, cells: int, oldest: int) -> list[tuple[str, Style]]:
        """Return what stands in each cell: what can no longer be looked at, the run, and what is to come."""
        last, present = self.last, self.present
        lost = ("┈", STYLES.faint)
        run = ("━", STYLES.primary)
        to_come = ("─", STYLES.faint)
        moments = [cell * last // cells for cell in range(cells)]
        return [to_come if moment >= present else lost if moment < oldest - 1 else run for moment in moments]

    def _format(self, moment: int) -> str:
        assert self.facts is not None
        minutes, seconds = divmod(moment * self.facts.dt, 60.0)
        return f"{int(minutes)}:{seconds:04.1f}"

    def on_mouse_down(self, event: events.MouseDown) -> None:
        self._dragging = True
        self.capture_mouse()
        self._seek_to_column(event.x)

    def on_mouse_move(self, event: events.MouseMove) -> None:
        if self._dragging:
            self._seek_to_column(event.x)

    def on_mouse_up(self) -> None:
        self._dragging = False
        self.release_mouse()

    def _seek_to_column(self, column: int) -> None:
        cells = max(1, self.content_size.width - 2 * _LABEL)
        cell = min(max(column - _LABEL, 0), cells - 1)
        moment = self.last if cell == cells - 1 else round((cell + 0.5) * self.last / cells)
        if moment != self._asked:
            self.seek(moment)


def _find_cell(moment: int, last: int, cells: int) -> int:
    return min(cells - 1, max(0, moment * cells // max(1, last)))
