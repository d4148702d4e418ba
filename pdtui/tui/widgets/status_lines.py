"""The lines at the edges of the screen: status, notices and keys."""

from __future__ import annotations

from pathlib import PurePath

from rich import filesize
from rich.cells import cell_len
from rich.style import Style
from textual import events
from textual.reactive import reactive
from textual.strip import Strip

from pdtui.core.printable_text import make_printable
from pdtui.sessions.episode_statistics import NO_STATISTICS
from pdtui.tui.cell_text import ScreenRow, displayed_key_name, fit_cells, format_number
from pdtui.tui.commands.key_clicked import KeyClicked
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES

_NAME = 40  # longest file name that is shown whole, in cells


class StatusLine(SnapshotWidget):
    """Shows the robot on the left and the drive's state on the right, as far as there is room."""

    watching: reactive[bool] = reactive(False, init=False, repaint=False)

    def paint(self, width: int, height: int) -> list[Strip]:
        del height
        title = self.map.robot if self.facts is None else self.facts.title
        row = ScreenRow(width).add(" pdtui ", STYLES.caps[1]).add(f" {make_printable(title)}", STYLES.title)
        parts = self._parts()
        shown: set[int] = set()
        left = row.left - 1
        for rank, text, _ in sorted(parts, key=lambda part: part[0]):
            length = cell_len(text) + 2
            if length <= left:
                left -= length
                shown.add(rank)
        row.add(" " * max(0, left), STYLES.text)
        for rank, text, style in parts:
            if rank in shown:
                row.add("  " + text, style)
        return [row.strip()]

    def _parts(self) -> list[tuple[int, str, Style]]:
        """Return rank, text and style of each part, from left to right; the lowest is the most important."""
        facts, snapshot = self.facts, self.snapshot
        if facts is None:
            return [
                (4, make_printable(self.map.policy), STYLES.muted),
                (0, "loading the policy…", STYLES.warn),
            ]
        policy = (6, make_printable(PurePath(facts.policy).name), STYLES.muted)
        seed = (8, f"seed {facts.seed}", STYLES.muted)
        if snapshot is None:
            return [policy, seed]
        recording = []
        if facts.recording:
            name = _shorten(make_printable(PurePath(facts.recording).name), _NAME)
            size = filesize.decimal(snapshot.recorded_bytes)
            recording = [(10, name, STYLES.muted), (3, f"● {size}", STYLES.bad)]
        manual = "  ".join(
            f"{make_printable(name)} {format_number(value)}" for name, value in snapshot.manual
        )
        arrivals = [] if snapshot.arrivals is None else [(4, f"arrived {snapshot.arrivals}", STYLES.muted)]
        cost = [(5, f"cost {snapshot.cost:g}", STYLES.muted)] if snapshot.cost else []
        return [
            *([(-1, f"manual: {manual}", STYLES.warn)] if manual else []),
            policy,
            *recording[:1],
            (9, f"episode {snapshot.episode}", STYLES.muted),
            seed,
            *arrivals,
            *cost,
            (7, f"involvement {snapshot.involvement}", STYLES.muted),
            (1, f"step {snapshot.step}", STYLES.text),
            (2, f"{snapshot.time:.1f} s", STYLES.text),
            *recording[1:],
            (0, *self._pace()),
        ]

    def _pace(self) -> tuple[str, Style]:
        snapshot = self.snapshot
        assert snapshot is not None
        if snapshot.past is not None:
            sign = "⏸" if snapshot.paused else f"▶ {snapshot.speed:g}×"
            return f"{sign} {snapshot.past.present - snapshot.step} steps ago", STYLES.warn
        if snapshot.finished:
            return "■ over", STYLES.bad
        kind = "watching " if self.watching else ""
        asked = f"{snapshot.speed:g}×"
        if snapshot.paused:
            return f"{kind}⏸ paused at {asked}", STYLES.warn
        slow = snapshot.achieved_speed < 0.93 * snapshot.speed
        return (
            f"{kind}▶ {asked} ({format_number(snapshot.achieved_speed)})",
            STYLES.warn if slow else STYLES.good,
        )


class NoticeLine(SnapshotWidget):
    """Shows what the user should read now; the reason for the drive's end stays."""

    notice: reactive[str] = reactive("", init=False, repaint=False)
    hints: reactive[str] = reactive("", init=False, repaint=False)
    past_hints: reactive[str] = reactive("", init=False, repaint=False)

    def watch_notice(self) -> None:
        self.redraw()

    def paint(self, width: int, height: int) -> list[Strip]:
        del height
        row, counters = ScreenRow(width), self._counters()
        past = self.snapshot is not None and self.snapshot.past is not None
        finished = self.snapshot.finished if self.snapshot is not None and not past else ""
        if finished:
            said, style = f" ■ the drive is over: {make_printable(finished)}   {self.hints} ", STYLES.alert
        elif self.notice:
            row.add(" ▌ ", STYLES.warn)
            said, style = make_printable(self.notice), STYLES.title
        else:
            row.add(" ▌ ", STYLES.faint)
            said, style = self._summary(), STYLES.muted
        room = row.left - cell_len(counters) - 2
        urgent = bool(finished or self.notice)
        if counters and (not urgent or cell_len(said) <= room):
            said = said if urgent else fit_cells(said, room)
            row.add(said, style).add(" " * (room - cell_len(said) + 1), STYLES.text)
            row.add(counters, STYLES.text)
        else:
            row.add(said, style)
        return [row.strip()]

    @property
    def _involvement(self) -> str:
        """What counts as human involvement, in words."""
        controls = self.facts is not None and bool(self.facts.manual_controls)
        return "with a key or a takeover" if controls else "with a key"

    def _counters(self) -> str:
        """Return distance, collisions, obstacles passed and involvement of an episode with any of them."""
        statistics = self.snapshot.statistics if self.snapshot is not None else NO_STATISTICS
        shown = [] if statistics.distance is None else [f"{format_number(statistics.distance)} m"]
        if statistics.collisions is not None:
            shown.append(f"{statistics.collisions:g} collision{'' if statistics.collisions == 1.0 else 's'}")
        if statistics.passed:  # none yet, or there is no course
            shown.append(f"{statistics.passed:g} passed")
        if not shown:
            return ""
        steps = "1 step" if statistics.involvement == 1 else f"{statistics.involvement} steps"
        keyed = f"{steps} {self._involvement} ({100.0 * statistics.share:.1f} %)"
        return f"episode {statistics.episode}: {' · '.join([*shown, keyed])}"

    def _summary(self) -> str:
        """Return the line shown while there is no notice."""
        if self.snapshot is None or self.facts is None:
            return "the drive starts once the policy is loaded"
        facts, past = self.facts, self.snapshot.past
        if past is not None:
            return f"step {self.snapshot.step} of {past.present}, as it was   {self.past_hints}"
        place = make_printable(facts.recording) or "not recorded"
        if self._counters():
            return f"seed {facts.seed} · {place}"
        share = 100.0 * self.snapshot.involvement / max(1, self.snapshot.step)
        steps = "1 step" if self.snapshot.involvement == 1 else f"{self.snapshot.involvement} steps"
        keyed = f"{steps} {self._involvement} ({share:.1f} %)"
        return f"seed {facts.seed} · episode {self.snapshot.episode} · {keyed} · {place}"


class KeyLine(SnapshotWidget):
    """Shows as many of the application's keys as fit; a click on one is a press of it.

    `keys` has Textual's name of each key, and what it does in a word.
    """

    keys: reactive[tuple[tuple[str, str], ...]] = reactive((), init=False, repaint=False)
    _ends: tuple[int, ...] = ()  # columns at which the keys shown end

    def on_click(self, event: events.Click) -> None:
        """Press the key that was clicked."""
        number = sum(end <= event.x for end in self._ends)
        if number < len(self._ends):
            self.post_message(KeyClicked(self.keys[number][0]))

    def watch_keys(self) -> None:
        self.redraw()

    def paint(self, width: int, height: int) -> list[Strip]:
        del height
        row = ScreenRow(width).add(" ", STYLES.text)
        ends = []
        for key, says in self.keys:
            cap = displayed_key_name(key)
            if cell_len(cap) + cell_len(says) + 3 > row.left:
                break
            row.add(cap, STYLES.accent).add(f" {says}  ", STYLES.muted)
            ends.append(width - row.left)
        self._ends = tuple(ends)
        return [row.strip()]


def _shorten(name: str, width: int) -> str:
    """Cut the middle of a file name, whose beginning and end say most."""
    if len(name) <= width:
        return name
    end = width // 2
    return f"{name[: width - end - 1]}…{name[-end:]}"
