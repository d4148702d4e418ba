"""The page of the controllers: what they do over time, and their gains."""

from __future__ import annotations

from collections import deque
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np
from textual.strip import Strip

from pdtui.core.drive_edits import write_edit
from pdtui.core.printable_text import make_printable
from pdtui.core.reserved_keys import EventKind
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.stimulation.stack.stack_entry import PidTuning
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_page import BenchPage
from pdtui.tui.widgets import sparklines

_ROWS: tuple[EventKind, ...] = ("kp", "ki", "kd", "target")
_GAIN_STEP = 1.1
_LEAST_GAIN = 0.01  # to which a key raises a gain of 0
_SECONDS = 12.0
_LABEL, _LIMIT = 8, 7  # widths beside a plot, in cells


class _Sample(NamedTuple):
    step: int
    target: float
    value: float
    error: float
    output: float


class PidPage(BenchPage):
    """A strip chart of the controller that was latched last, with its gains below.

    The target is the dotted line beside the value. One sample per snapshot.
    """

    TAB: ClassVar[str] = "pid"
    KEYS: ClassVar[str] = "←→ change  = type"

    def on_mount(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=1000)
        self._behavior = ""

    def remember(self, snapshot: DriveSnapshot) -> None:
        held = [view for view in snapshot.active_behaviors if view.target is not None]
        name = held[-1].name if held else ""
        if name != self._behavior or (self._samples and snapshot.step < self._samples[-1].step):
            self._samples.clear()
            self._behavior = name
        if held and (not self._samples or snapshot.step > self._samples[-1].step):
            view = held[-1]
            numbers = (view.target, view.value, view.error, view.magnitude)
            self._samples.append(_Sample(snapshot.step, *(float(one or 0.0) for one in numbers)))

    def count_rows(self) -> int:
        return len(_ROWS) if self._gains() is not None else 0

    def draw_head(self, width: int) -> list[Strip]:
        if self.facts is None or self._gains() is None:
            said = "no behavior of mode pid is latched"
            return [ScreenRow(width).add(said, STYLES.faint).strip()]
        behavior = self.map.behaviors[self._behavior]
        assert behavior.pid is not None
        unit = {one.name: one.unit for one in self.facts.attributes}.get(behavior.pid.attribute, "")
        style, last = STYLES.behavior(self.row_of(self._behavior)), self._samples[-1]
        title = ScreenRow(width).add(f"{make_printable(self._behavior)} ", style)
        title.add(
            f"{format_number(last.value)} → {format_number(last.target)} {make_printable(unit)}", STYLES.text
        )
        title.add(f"  error {format_number(last.error)}", STYLES.muted)
        return [title.strip(), *self._draw_charts(width)]

    def draw_row(self, row: int, line: ScreenRow, *, marked: bool) -> None:
        gains, pid = self._gains(), self.map.behaviors[self._behavior].pid
        assert gains is not None
        assert pid is not None
        now = gains[row] if row < len(gains) else self._samples[-1].target
        line.add(f"{_ROWS[row]} ", STYLES.title if marked else STYLES.muted, _LABEL)
        line.add(f"{now:.4g}", STYLES.title, 10)
        if row < len(gains) and (own := float(getattr(pid, _ROWS[row]))) != now:
            line.add(f"  in the map {own:.4g}", STYLES.faint)

    def change(self, presses: int) -> None:
        gains = self._gains()
        if gains is None:
            return
        if self.marked < len(gains):
            now = gains[self.marked] or (_LEAST_GAIN if presses > 0 else 0.0)
            self._set(self.marked, float(f"{now * _GAIN_STEP**presses:.4g}"))
        elif (pid := self.map.behaviors[self._behavior].pid) is not None:
            self._set(self.marked, self._samples[-1].target + presses * pid.step)

    def type_value(self, begun: str) -> None:
        if self._gains() is not None:
            what = f"{_ROWS[self.marked]} of {self._behavior}"
            self.bench.ask_number(what, begun, partial(self._set, self.marked))

    def _set(self, row: int, value: float) -> None:
        self.bench.send(write_edit(_ROWS[row], self._behavior, value))

    def _gains(self) -> PidTuning | None:
        stack = () if self.snapshot is None or not self._samples else self.snapshot.stack
        return next((layer.gains for layer in stack if layer.name == self._behavior), None)

    def _draw_charts(self, width: int) -> list[Strip]:
        """Return two lines each for value and target, and for the output."""
        assert self.facts is not None
        cells = width - _LABEL - _LIMIT
        if cells < 4:
            return []
        points = 2 * cells
        now, reach = self._samples[-1].step, max(1.0, _SECONDS / self.facts.dt)
        own, target = np.full((points, 2), np.nan), np.full((points, 2), np.nan)
        for sample in self._samples:
            point = points - 1 - int((now - sample.step) / reach * points)
            if point >= 0:
                own[point], target[point] = (sample.value, sample.output), (sample.target, np.nan)
        for column in range(2):
            _fill_gaps(own[:, column])
        _fill_gaps(target[:, 0])
        everything = np.concatenate([own, target])
        low, high = (np.nan_to_num(find.reduce(everything)) for find in (np.fmin, np.fmax))
        scales = sparklines.fit_scales(everything, low, high)
        styles = [STYLES.behavior(self.row_of(self._behavior)), STYLES.primary]
        plots = sparklines.draw_line_plots(own, target, scales, styles)
        strips = []
        for number, plot in enumerate(plots):
            column = number // 2
            label = ("value", "target", "output", "c")[number] if number != 1 else "┄target"
            end = float((scales.top, scales.bottom)[number % 2][column])
            row = ScreenRow(width).add(label, STYLES.muted if number != 1 else STYLES.ghost, _LABEL)
            said = sparklines.format_scale_limit(end, float(scales.top[column] - scales.bottom[column]))
            strips.append(row.add(said + " ", STYLES.faint, _LIMIT, right=True).add_strip(plot).strip())
        return strips


def _fill_gaps(values: np.ndarray) -> None:
    """Hold each value until the next one, in place."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known):
        places = np.searchsorted(known, np.arange(len(values)), side="right") - 1
        values[known[0] :] = values[known[places[known[0] :]]]
