"""The page of the controllers: what they do over time, and their gains."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np
from textual.strip import Strip

from pdtui.core.drive_edits import write_edit
from pdtui.core.errors import PdtuiError
from pdtui.core.printable_text import make_printable
from pdtui.core.reserved_keys import EventKind
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.search.gain_tuning_process import TUNING_MINUTES, TUNING_SEEDS, GainTuningState, OfferedGains
from pdtui.stimulation.pid_magnitude import GainName
from pdtui.stimulation.stack.stack_entry import PidTuning
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.theme import STYLES
from pdtui.tui.unit_bench.bench_page import BenchPage
from pdtui.tui.unit_bench.bench_saving import save_gains
from pdtui.tui.widgets import sparklines

_GAINS: tuple[GainName, ...] = ("kp", "ki", "kd", "limit")
_TARGET, _TUNE = len(_GAINS), len(_GAINS) + 1  # rows
_ORIGINS = {"map": "the map's", "proportional": "P alone", "found": "found"}
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
    KEYS: ClassVar[str] = "←→ change  = type  ↵ tune, take  ^s save"

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
        return _TUNE + 1 + len(self._offered()) if self._gains() is not None else 0

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
        gains, pid = self._gains(), self.bench.target.behaviors[self._behavior].pid
        assert gains is not None
        assert pid is not None
        style = STYLES.title if marked else STYLES.muted
        if row < _TARGET:
            line.add(f"{_GAINS[row]} ", style, _LABEL).add(f"{gains[row]:.4g}", STYLES.title, 10)
            if (own := float(getattr(pid, _GAINS[row]))) != gains[row]:
                line.add(f"  in the map {own:.4g}", STYLES.faint)
        elif row == _TARGET:
            line.add("target ", style, _LABEL).add(f"{self._samples[-1].target:.4g}", STYLES.title, 10)
        elif row == _TUNE:
            line.add("tune ", style, _LABEL).add(self._describe_tuning(), STYLES.muted)
        else:
            self._draw_offered(self._offered()[row - _TUNE - 1], line, marked=marked)

    def change(self, presses: int) -> None:
        gains = self._gains()
        if gains is None:
            return
        if self.marked < _TARGET:
            now = gains[self.marked] or (_LEAST_GAIN if presses > 0 else 0.0)
            self._set(self.marked, float(f"{now * _GAIN_STEP**presses:.4g}"))
        elif self.marked == _TARGET and (pid := self.map.behaviors[self._behavior].pid) is not None:
            self._set(self.marked, self._samples[-1].target + presses * pid.step)

    def choose(self) -> None:
        """Begin to tune, or take the gains of the marked row."""
        gains = self._gains()
        if gains is None or self.marked < _TUNE:
            return
        if self.marked > _TUNE:
            offered = self._offered()[self.marked - _TUNE - 1].pid
            for row, name in enumerate(_GAINS):
                if (value := getattr(offered, name)) != gains[row]:
                    self._set(row, value)
        elif self.bench.tuning is None:
            self.bench.say("there is no tuning here")
        elif notice := self.bench.tuning.tune(self._behavior):
            self.bench.say(notice)

    def type_value(self, begun: str) -> None:
        if self._gains() is not None and self.marked <= _TARGET:
            what = f"{(*_GAINS, 'target')[self.marked]} of {self._behavior}"
            self.bench.ask_number(what, begun, partial(self._set, self.marked))

    def save(self) -> bool:
        gains, bench = self._gains(), self.bench
        if gains is None or self.facts is None:
            bench.say("no behavior of mode pid is latched whose gains could be saved")
            return True
        name, behavior = self._behavior, bench.target.behaviors[self._behavior]
        assert behavior.pid is not None
        pid = replace(behavior.pid, **gains._asdict())
        tuned = any(one.origin != "map" and one.pid == pid for one in self._offered())
        try:
            path = save_gains(bench.target, self.facts, name, pid, TUNING_SEEDS if tuned else None)
        except PdtuiError as error:
            bench.say(str(error))
            return True
        behaviors = {**bench.target.behaviors, name: replace(behavior, pid=pid)}
        bench.target = replace(bench.target, source=str(path), behaviors=behaviors)
        bench.say(f"gains saved in {path}; latched anew in this drive, it has the old ones")
        return True

    def _set(self, row: int, value: float) -> None:
        kind: EventKind = "target" if row == _TARGET else _GAINS[row]
        self.bench.send(write_edit(kind, self._behavior, value))

    def _tuning(self) -> GainTuningState | None:
        state = None if self.bench.tuning is None else self.bench.tuning.state
        return state if state is not None and state.behavior == self._behavior else None

    def _offered(self) -> tuple[OfferedGains, ...]:
        state = self._tuning()
        return () if state is None else state.offered

    def _describe_tuning(self) -> str:
        state = self._tuning()
        if state is None:
            return f"↵: {60 * TUNING_MINUTES:.0f} s, in a process of its own"
        if state.condition == "failed":
            return make_printable(state.message)
        if state.condition == "loading":
            return "loading robot and policy…"
        return f"{state.tried} controllers tried" + ("…" if state.condition == "tuning" else "; ↵ takes one")

    def _draw_offered(self, one: OfferedGains, line: ScreenRow, *, marked: bool) -> None:
        taken = self._gains() == tuple(getattr(one.pid, name) for name in _GAINS)
        line.add("● " if taken else "○ ", STYLES.accent if taken else STYLES.faint)
        line.add(f"{_ORIGINS.get(one.origin, one.origin)} ", STYLES.title if marked else STYLES.text, 10)
        line.add(format_number(one.error), STYLES.good)
        line.add(f" fell {one.failures}/{one.drives}" if one.failures else "", STYLES.bad)
        pid = one.pid
        line.add(f" {pid.kp:.3g}/{pid.ki:.3g}/{pid.kd:.3g} ±{pid.limit:.3g}", STYLES.muted)

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
