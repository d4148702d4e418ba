"""The list of behaviors: keys, descriptions, and which are latched for how long."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.style import Style
from textual.geometry import Size
from textual.strip import Strip

from pdtui.core.printable_text import make_printable
from pdtui.stimulation.stack.stack_entry import is_muted
from pdtui.tui.cell_text import ScreenRow, displayed_key_name, fit_cells, format_number, format_signed
from pdtui.tui.commands.key_clicked import KeyClicked
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.scrolled_list import ScrolledList

if TYPE_CHECKING:
    from textual import events

    from pdtui.core.step_record import ActiveBehavior
    from pdtui.driving.drive_snapshot import DriveSnapshot
    from pdtui.stimulation.stimulation_map import Behavior

_ECHO_SNAPSHOTS = 12  # after which a key that the drive did not mention is no longer shown as pressed
_SHARE = 0.56  # of the height of its column, as in the style sheet
_BAR = 10  # length of the bar of the time left, in cells
_BLOCKS = " ▏▎▍▌▋▊▉"


class BehaviorList(ScrolledList):
    """Shows two lines per behavior if there is room, else one; latched behaviors are never hidden."""

    BORDER_TITLE = "behaviors"
    _line_keys: tuple[str, ...] = ()

    def on_click(self, event: events.Click) -> None:
        """Latch the behavior that was clicked."""
        place = event.get_content_offset(self)
        if place is not None and place.y < len(self._line_keys) and self._line_keys[place.y]:
            self.post_message(KeyClicked(self._line_keys[place.y]))

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """Return the lines that all behaviors take: two each where there is room, else one."""
        del viewport, width
        frame = self.gutter.height  # which the container comes without
        room = int((container.height + frame) * _SHARE) - frame
        count = len(self.map.behaviors)
        controllers = sum(behavior.pid is not None for behavior in self.map.behaviors.values())
        roomy = 2 * count + controllers + 2
        return roomy if roomy <= room else max(1, min(count + controllers + 1, room))

    def forget(self) -> None:
        self._echoes: dict[str, int] = {}

    def echo(self, key: str) -> None:
        """Show a key as pressed at once, until the drive has confirmed or refused it."""
        self._echoes[key] = _ECHO_SNAPSHOTS
        self.redraw()

    def remember(self, snapshot: DriveSnapshot) -> None:
        if self._echoes:
            latched = {view.name for view in snapshot.active_behaviors}
            done = {press.key for press in snapshot.key_presses}
            done |= {self.map.behaviors[name].key for name in latched if name in self.map.behaviors}
            if not latched:
                done.add(self.map.default_key)
            left = {key: count - 1 for key, count in self._echoes.items() if key not in done}
            self._echoes = {key: count for key, count in left.items() if count and not snapshot.notice}

    def paint(self, width: int, height: int) -> list[Strip]:
        active = (
            {view.name: view for view in self.snapshot.active_behaviors} if self.snapshot is not None else {}
        )
        behaviors = list(self.map.behaviors.values())
        if not behaviors:
            return [ScreenRow(width).add("none: the map has no behaviors", STYLES.faint).strip()]
        names = [make_printable(behavior.name) for behavior in behaviors]
        keys = [displayed_key_name(behavior.key) for behavior in behaviors]
        key_width = max(map(cell_len, keys)) + 2
        name_width = min(max(map(cell_len, names)), max(8, width // 3))
        self._columns = (key_width, name_width)
        # Controllers' lines count even while none is latched, so that a key press does not change the layout.
        controllers = sum(behavior.pid is not None for behavior in behaviors)
        roomy = 2 * len(behaviors) + controllers + 2 <= height
        entries = [
            self._entry(row, behavior, active.get(behavior.name), width, roomy=roomy)
            for row, behavior in enumerate(behaviors)
        ]
        gap = [Strip.blank(width)] if roomy else []
        latched = [behavior.name in active for behavior in behaviors]
        shown, rows = self._crop(entries, latched, width, height - 1 - len(gap))
        self._line_keys = (*(behaviors[row].key for row in rows), *("" for _ in shown[len(rows) :]))
        self._line_keys += (*("" for _ in gap), self.map.default_key)
        default = ScreenRow(width)
        echoed = self.map.default_key in self._echoes
        self._add_cap(default, self.map.default_key, STYLES.caps[0] if echoed else STYLES.key)
        default.add("  clears all stimulation", STYLES.good if active else STYLES.muted)
        return [*shown, *gap, default.strip()]

    def _entry(
        self, row: int, behavior: Behavior, active: ActiveBehavior | None, width: int, *, roomy: bool
    ) -> list[Strip]:
        name_width = self._columns[1]
        color = STYLES.behavior(row)
        says = make_printable(behavior.says)
        line = ScreenRow(width)
        if active is None and behavior.key in self._echoes:
            self._add_cap(line, behavior.key, STYLES.caps[row % len(STYLES.caps)])
            line.add(" ▌", color).add(make_printable(behavior.name), color, name_width)
            lines = [line.add("  pressed", color).strip()]
        elif active is None:
            self._add_cap(line, behavior.key, STYLES.key)
            line.add("  " + make_printable(behavior.name), color, name_width + 2).add("  ", STYLES.text)
            if self.snapshot is not None and is_muted(behavior.name, self.snapshot.stack):
                line.add("muted  ", STYLES.warn)
            line.add(self._kind(behavior) if roomy else says, STYLES.muted)
            lines = [line.strip()]
        else:
            self._add_cap(line, behavior.key, STYLES.caps[row % len(STYLES.caps)])
            line.add(" ▌", color)
            name = make_printable(behavior.name)
            line.add(name, color + Style(bold=True), name_width).add("  ", STYLES.text)
            self._add_state(line, behavior, active, color)
            lines = [line.strip()]
            if active.target is not None:
                lines.append(self._control(behavior, active, width))
        if roomy:
            indent = " " * (self._columns[0] + 2)
            sentence = fit_cells(" ".join(says.split()), width - len(indent)).rstrip()
            style = STYLES.muted if active is None else STYLES.text
            lines.insert(1, ScreenRow(width).add(indent + sentence, style).strip())
        return lines

    def _add_cap(self, line: ScreenRow, key: str, style: Style) -> None:
        """Add the key as a cap, padded to the width of the widest."""
        cap = f" {displayed_key_name(key)} "
        line.add(cap, style).add(" " * (self._columns[0] - cell_len(cap)), STYLES.text)

    def _kind(self, behavior: Behavior) -> str:
        if behavior.pid is not None:
            return f"holds {make_printable(behavior.pid.attribute)}"
        return "" if behavior.period is None else f"for {format_number(behavior.period)} s"

    def _add_state(self, line: ScreenRow, behavior: Behavior, active: ActiveBehavior, color: Style) -> None:
        """Add the time left as a draining bar, the word "latched", or "armed" with the time to go."""
        dt = None if self.facts is None else self.facts.dt
        if active.waiting is not None:
            line.add("armed", color)
            if active.waiting >= 0 and dt is not None:
                line.add(f" {active.waiting * dt:.1f} s", color)
        elif active.remaining is None or dt is None or behavior.period is None:
            line.add("latched", color)
        else:
            steps = max(1, round(behavior.period / dt))
            line.add(_bar(active.remaining / steps, _BAR), color + Style(bgcolor=STYLES.key.bgcolor))
            line.add(f" {active.remaining * dt:.1f} s", color)
        if abs(active.factor - 1.0) > 1e-9:
            line.add(f"  × {format_number(active.factor)}", STYLES.accent)

    def _control(self, behavior: Behavior, active: ActiveBehavior, width: int) -> Strip:
        """Return the line with value, target, error and magnitude c of a controller."""
        unit = self._unit_of(behavior)
        row = ScreenRow(width).add(" " * (self._columns[0] + 2), STYLES.text)
        parts = (
            ("", f"{format_number(active.value or 0.0)} → {format_number(active.target or 0.0)} {unit}"),
            (" e ", format_signed(active.error or 0.0)),
            (" c ", format_signed(active.magnitude or 0.0)),
        )
        for label, value in parts:
            row.add(label, STYLES.muted).add(value, STYLES.text)
        return row.strip()

    def _unit_of(self, behavior: Behavior) -> str:
        if self.facts is None or behavior.pid is None:
            return ""
        named = {attribute.name: attribute.unit for attribute in self.facts.attributes}
        return make_printable(named.get(behavior.pid.attribute, ""))

    def _crop(
        self, entries: list[list[Strip]], latched: list[bool], width: int, height: int
    ) -> tuple[list[Strip], list[int]]:
        """Return as many entries as fit, in the order of the map, and the number of the entry in each line.

        Latched ones are kept first, then those from where the list is scrolled to. The last line counts what
        is hidden.
        """
        everything = range(len(entries))
        if sum(map(len, entries)) <= height:
            self._first = self._hidden = 0
            strips = [strip for entry in entries for strip in entry]
            return strips, [index for index in everything for _ in entries[index]]
        room = height - 1
        chosen = []
        for index in sorted(everything, key=lambda index: (not latched[index], index < self._first, index)):
            if len(entries[index]) <= room:
                room -= len(entries[index])
                chosen.append(index)
        strips = [strip for index in sorted(chosen) for strip in entries[index]]
        self._hidden = len(entries) - len(chosen)
        more = ScreenRow(width).add(f"+{self._hidden} more: ? lists all", STYLES.muted)
        return [*strips, more.strip()], [index for index in sorted(chosen) for _ in entries[index]]


def _bar(share: float, cells: int) -> str:
    """Return a bar drawn in eighths of a cell."""
    eighths = round(min(max(share, 0.0), 1.0) * cells * 8)
    full, rest = divmod(eighths, 8)
    return ("█" * full + (_BLOCKS[rest] if rest else "")).ljust(cells)
