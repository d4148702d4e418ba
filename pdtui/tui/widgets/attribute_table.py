"""The table of kinematic attributes: present value, target and recent history, of the ghost too."""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

import numpy as np
from rich.cells import cell_len
from rich.style import Style
from textual.strip import Strip

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.core.printable_text import make_printable
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.driving.ghost.ghost_snapshot import GhostPose
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.cell_text import ScreenRow, format_number, format_signed
from pdtui.tui.ghost_drawing import add_ghost_to_title
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets import sparklines
from pdtui.tui.widgets.attribute_history import AttributeHistory
from pdtui.tui.widgets.attribute_window import AttributeWindow, is_force_unit
from pdtui.tui.widgets.key_press_axis import KeyPressAxis

_SECONDS = 12.0  # length of the history that a plot shows
_ROWS_KEPT = 4096  # control steps
_VALUE, _UNIT, _TARGET, _END = 8, 6, 10, 7  # widths of the columns with the space beside them, in cells
_CHANGE = 9  # the same of a difference
_LEAST_NAME, _LEAST_PLOT = 8, 12  # cells
_WIDE = 50  # cells from which two lines have room for targets
_WITHOUT = "without"
_Targets = dict[int, tuple[float, Style]]


class _Layout(NamedTuple):
    """Lines per attribute, and the widths of the whole line, the name, the unit and the target, in cells."""

    lines: int
    width: int
    name: int
    unit: int
    target: int

    @property
    def plot(self) -> int:
        """Width of the plot, in cells."""
        end = _END if self.lines > 1 else 1
        return max(0, self.width - self.name - _VALUE - self.unit - self.target - end)

    @property
    def points(self) -> int:
        """Number of means that a plot shows: two per cell where it is drawn with dots."""
        return self.plot * self.lines


class AttributeTable(SnapshotWidget):
    """Shows each attribute in one line, or in two where there is room, or a ghost to compare with.

    If not all fit, the table scrolls; forces and torques come last. The last line is the time axis, with the
    keys; two lines for each attribute leave it out where there is little room.
    """

    BORDER_TITLE = "attributes"

    def __init__(self, stimulation_map: StimulationMap, *, id: str | None = None) -> None:
        super().__init__(stimulation_map, id=id)
        self._choice = AttributeWindow(stimulation_map)

    def handle_request(self, request: str) -> None:
        """Show the next attributes, or those before."""
        if self._choice.scroll_page(1 if request == "next" else -1):
            self.redraw()

    def on_mouse_scroll_down(self) -> None:
        if self._choice.scroll(1):
            self.redraw()

    def on_mouse_scroll_up(self) -> None:
        if self._choice.scroll(-1):
            self.redraw()

    def forget(self) -> None:
        self._history: AttributeHistory | None = None
        self._keys = KeyPressAxis()

    def remember(self, snapshot: DriveSnapshot) -> None:
        if self._history is None:
            self._history = AttributeHistory(_ROWS_KEPT, len(snapshot.attributes))
        self._history.add_snapshot(snapshot)
        self._keys.extend(snapshot.key_presses)
        title = add_ghost_to_title(self.BORDER_TITLE, snapshot.ghost, snapshot.step)
        if self.border_title != title:
            self.border_title = title

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.facts is None or self._history is None:
            return [ScreenRow(width).add("waiting for the policy", STYLES.faint).strip()]
        forces = sum(is_force_unit(attribute.unit) for attribute in self.facts.attributes)
        others = len(self.facts.attributes) - forces
        ghost = self.snapshot is not None and self.snapshot.ghost is not None
        lines = 2 if ghost or 2 * others < height else 1
        axis = lines == 1 or height % 2 == 1 or height >= 10
        shown = self._choice.choose(self.facts, (height - axis) // lines)
        more = f"+{self._choice.hidden_count} more: scroll" if self._choice.hidden_count else ""
        if more != (self.border_subtitle or ""):
            self.border_subtitle = more
        layout = self._lay_out(shown, width, lines)
        strips = (self._paint_pairs if lines > 1 else self._paint_lines)(shown, layout)
        if axis:
            strips += [Strip.blank(width)] * (height - 1 - len(strips)) + [self._paint_axis(layout)]
        return strips

    def _lay_out(self, shown: list[int], width: int, lines: int) -> _Layout:
        assert self.facts is not None
        names = [cell_len(make_printable(self.facts.attributes[index].name)) for index in shown]
        unit = _UNIT if lines == 1 else max(_UNIT, _CHANGE)
        target = _TARGET if lines == 1 or width >= _WIDE else 0
        least = _Layout(lines, width, 0, unit, target)
        names += [len(_WITHOUT)] * (lines - 1)
        name = min(max(names, default=0), max(_LEAST_NAME, least.plot - _LEAST_PLOT))
        return least._replace(name=name)

    def _paint_lines(self, shown: list[int], layout: _Layout) -> list[Strip]:
        """Paint name, value, unit, target or the plot's range, and a sparkline, dimmer below 0."""
        means = self._means(shown, layout)
        scales = self._fit_scales(shown, means)
        strips, targets = [], self._targets()
        plots = sparklines.draw_sparklines(means, scales)
        below = scales.crosses_zero & (np.nan_to_num(means) < 0.0)
        for row, index in enumerate(shown):
            target, style = targets.get(index, (None, STYLES.primary))
            line = self._begin_line(index, layout, targets)
            if target is None:
                room = layout.target - 1
                said = sparklines.format_range(float(scales.bottom[row]), float(scales.top[row]), room)
                line.add(" " + said, STYLES.faint, layout.target)
            line.add(" ", STYLES.text)
            dim = STYLES.below if target is None else style
            for text, is_below in sparklines.split_marked_text(plots[row], below[:, row]):
                line.add(text, dim if is_below else style)
            strips.append(line.strip())
        return strips

    def _paint_pairs(self, shown: list[int], layout: _Layout) -> list[Strip]:
        """Paint a plot with its range beside value and unit, and the ghost's value and the difference."""
        own, ghost = self._means(shown, layout), self._means(shown, layout, ghost=True)
        scales = self._fit_scales(shown, np.concatenate([own, ghost]))
        targets, moment = self._targets(), self._moment()
        styles = [targets.get(index, (0.0, STYLES.primary))[1] for index in shown]
        plots = sparklines.draw_line_plots(own, ghost, scales, styles) if layout.plot else []
        strips = []
        for row, index in enumerate(shown):
            top, bottom = float(scales.top[row]), float(scales.bottom[row])
            pair = (self._begin_line(index, layout, targets), self._begin_ghost_line(index, layout, moment))
            for number, (line, end) in enumerate(zip(pair, (top, bottom), strict=True)):
                said = sparklines.format_scale_limit(end, top - bottom)
                line.add(said + " ", STYLES.faint, _END, right=True)
                if plots:
                    line.add_strip(plots[2 * row + number])
                strips.append(line.strip())
        return strips

    def _moment(self) -> GhostPose | None:
        """Return the control step in which drive and ghost are compared, if any."""
        ghost = None if self.snapshot is None or self.snapshot.past is not None else self.snapshot.ghost
        return None if ghost is None or ghost.condition == "over" else ghost.latest

    def _begin_line(self, index: int, layout: _Layout, targets: _Targets) -> ScreenRow:
        """Return a line with name, value and unit, and with the target if there is one."""
        assert self.facts is not None
        assert self.snapshot is not None
        attribute, moment = self.facts.attributes[index], self._moment()
        values = self.snapshot.attributes if moment is None else moment.drive_attributes
        target, style = targets.get(index, (None, STYLES.text))
        line = ScreenRow(layout.width).add(make_printable(attribute.name), style, layout.name)
        line.add(" " + format_number(float(values[index])), STYLES.title, _VALUE, right=True)
        line.add(" " + make_printable(attribute.unit), STYLES.muted, layout.unit)
        if target is not None or layout.lines > 1:
            line.add("" if target is None else f"→ {format_number(target)}", style, layout.target)
        return line

    def _begin_ghost_line(self, index: int, layout: _Layout, moment: GhostPose | None) -> ScreenRow:
        """Return a line with the value without the behavior, and by how much it is another."""
        assert self.facts is not None
        assert self.snapshot is not None
        line, value, change = ScreenRow(layout.width), "", ""
        if moment is not None:
            own, other = float(moment.drive_attributes[index]), float(moment.attributes[index])
            wraps = self.facts.attributes[index].wraps
            value = format_number(other)
            change = f" Δ{format_signed(wrap_angle(own - other) if wraps else own - other)}"
        ghost = self.snapshot.ghost
        said = "" if ghost is None else make_printable(ghost.label) or _WITHOUT
        line.add(said, STYLES.ghost, layout.name)
        line.add(" " + value, STYLES.ghost, _VALUE, right=True)
        return line.add(change, STYLES.muted, layout.unit + layout.target)

    def _paint_axis(self, layout: _Layout) -> Strip:
        """Paint how far the plots reach back, and the keys where they were pressed."""
        assert self.facts is not None
        assert self._history is not None
        history, steps = self._history, self._steps_per_point(layout)
        reach = f"last {layout.points * steps * self.facts.dt:.0f} s "
        line = ScreenRow(layout.width).add(reach, STYLES.faint, layout.width - layout.plot, right=True)
        self._keys.draw_axis(
            line,
            layout.plot,
            lambda step: history.cell_of(step, layout.points, steps) // max(1, layout.lines),
        )
        return line.strip()

    def _targets(self) -> _Targets:
        """Return target and color of each attribute that a controller holds, by its index."""
        assert self.facts is not None
        names = [attribute.name for attribute in self.facts.attributes]
        targets: _Targets = {}
        for active in self.snapshot.active_behaviors if self.snapshot is not None else ():
            behavior = self.map.behaviors.get(active.name)
            pid = None if behavior is None else behavior.pid
            if pid is not None and active.target is not None and pid.attribute in names:
                style = STYLES.behavior(self.row_of(active.name))
                targets[names.index(pid.attribute)] = (active.target, style)
        return targets

    def _steps_per_point(self, layout: _Layout) -> int:
        assert self.facts is not None
        points = max(1, layout.points)
        return max(1, min(ceil(_SECONDS / self.facts.dt / points), _ROWS_KEPT // points))

    def _means(self, shown: list[int], layout: _Layout, *, ghost: bool = False) -> Floats:
        """Return the means that the plots show, shape (points, attributes)."""
        assert self._history is not None
        if not layout.points:
            return np.empty((0, len(shown)))
        return self._history.means(layout.points, self._steps_per_point(layout), ghost=ghost)[:, shown]

    def _fit_scales(self, shown: list[int], values: Floats) -> sparklines.PlotScales:
        assert self.facts is not None
        assert self._history is not None
        low, high = self._history.low[shown], self._history.high[shown]
        # An angle is scaled to several turns, so that its jump at ±π stays small in the plot.
        for column, index in enumerate(shown):
            if self.facts.attributes[index].wraps and np.nanmax(np.abs(values[:, column]), initial=0.0) > 1.5:
                low[column], high[column] = -20 * pi, 20 * pi
        return sparklines.fit_scales(values, low, high)
