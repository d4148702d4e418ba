"""What happened at which control step of a run, as marks of one cell."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from rich.style import Style

from pdtui.core.outcome import Outcome, is_failure
from pdtui.driving.drive_snapshot import EpisodeEnd, KeyPress
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.key_press_axis import key_symbol

MOST_MARKS = 5000


class TimelineMark(NamedTuple):
    """A mark of one cell.

    Attributes:
        moment: number of control steps that had been done when it happened.
        sign: the character.
        style: its color.
        rank: the mark with the highest is shown where several are in a cell.
    """

    moment: int
    sign: str
    style: Style
    rank: int


class TimelineMarks:
    """Keys and ends of episodes, in the order in which they happened."""

    def __init__(self) -> None:
        self._marks: list[TimelineMark] = []

    def __iter__(self) -> Iterator[TimelineMark]:
        return iter(self._marks)

    def add(self, keys: Iterable[KeyPress], ends: Iterable[EpisodeEnd]) -> None:
        """Add what has happened since; the oldest are forgotten beyond `MOST_MARKS`."""
        new = [*map(_mark_key, keys), *map(_mark_end, ends)]
        if new:
            self._marks = sorted([*self._marks, *new], key=lambda mark: mark.moment)[-MOST_MARKS:]

    def next_to(self, moment: int, direction: int) -> int | None:
        """Return the moment of the first mark before (−1) or after (1) a moment; None without one."""
        if direction < 0:
            return max((mark.moment for mark in self._marks if mark.moment < moment), default=None)
        return min((mark.moment for mark in self._marks if mark.moment > moment), default=None)


def _mark_key(press: KeyPress) -> TimelineMark:
    style = STYLES.title if press.behavior < 0 else STYLES.behavior(press.behavior)
    return TimelineMark(press.step, key_symbol(press.key), style, 0)


def _mark_end(end: EpisodeEnd) -> TimelineMark:
    # The end is shown with the step that brought it: the next one begins elsewhere.
    if end.outcome is Outcome.ARRIVED:
        return TimelineMark(end.step + 1, "✓", STYLES.good, 2)
    return TimelineMark(end.step + 1, "✕" if is_failure(end.outcome) else "│", STYLES.bad, 2)
