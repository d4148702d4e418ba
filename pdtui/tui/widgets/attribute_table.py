"""The table of kinematic attributes: present value, target and recent history."""

from __future__ import annotations

from math import ceil, pi

import numpy as np
from rich.cells import cell_len
from textual.strip import Strip

from pdtui.core.attributes import Floats
from pdtui.core.printable_text import make_printable
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import STYLES

_SECONDS = 12.0  # length of the history that a line shows
_ROWS_KEPT = 4096  # control steps
_VALUE, _UNIT, _TARGET = 7, 5, 10  # widths of the columns, in cells
_FORCES = ("N", "N m", "Nm")
_LEVELS = np.array([ord(character) for character in " ▁▂▃▄▅▆▇█"], "<u4")
_LEAST_SHARE = 0.05  # of the range so far, to which a line is scaled at least


class AttributeTable(SnapshotWidget):
    """Shows one attribute per line; if not all fit, forces and torques are left out first."""

    BORDER_TITLE = "attributes"
    _history: AttributeHistory | None = None

    def remember(self, snapshot: DriveSnapshot) -> None:
        if self._history is None:
            self._history = AttributeHistory(_ROWS_KEPT, len(snapshot.attributes))
        self._history.extend(snapshot.history)

    def paint(self, width: int, height: int) -> list[Strip]:
        if self.facts is None:
            return [ScreenRow(width).add("waiting for the policy", STYLES.faint).strip()]
        shown = self._choose(height)
        attributes = [self.facts.attributes[index] for index in shown]
        widest = max((cell_len(make_printable(attribute.name)) for attribute in attributes), default=0)
        holds = any(behavior.pid is not None for behavior in self.map.behaviors.values())
        target_width = _TARGET if holds else 0
        fixed = _VALUE + _UNIT + target_width + 3
        name_width = min(widest, max(8, width - fixed - 12))
        cells = max(0, width - fixed - name_width)
        lines = self._sparklines(shown, cells) if self._history is not None else [""] * len(shown)
        targets = self._targets()
        values = None if self.snapshot is None else self.snapshot.attributes
        strips = []
        for index, attribute, line in zip(shown, attributes, lines, strict=True):
            target, row = targets.get(attribute.name, (None, -1))
            name_style = STYLES.text if target is None else STYLES.behavior(row)
            value = "" if values is None else format_number(float(values[index]))
            strips.append(
                ScreenRow(width)
                .add(make_printable(attribute.name), name_style, name_width)
                .add(" " + value, STYLES.title, _VALUE + 1, right=True)
                .add(" " + make_printable(attribute.unit), STYLES.muted, _UNIT + 1)
                .add("" if target is None else f"→ {format_number(target)}", name_style, target_width)
                .add(" " + line, STYLES.primary if target is None else STYLES.behavior(row))
                .strip()
            )
        return strips

    def _choose(self, height: int) -> list[int]:
        """Return the indices of the attributes to show, in the robot's order."""
        assert self.facts is not None
        named = {primitive.attribute for primitive in self.map.primitives.values()}
        for behavior in self.map.behaviors.values():
            named |= {part.attribute for part in (behavior.aim, behavior.pid) if part is not None}

        def rank(index: int) -> tuple[bool, bool, int]:
            assert self.facts is not None
            attribute = self.facts.attributes[index]
            force = attribute.unit in _FORCES
            return force, attribute.name not in named, index

        return sorted(sorted(range(len(self.facts.attributes)), key=rank)[:height])

    def _targets(self) -> dict[str, tuple[float, int]]:
        """Return target and behavior row of each attribute that a controller holds."""
        targets: dict[str, tuple[float, int]] = {}
        for active in self.snapshot.active_behaviors if self.snapshot is not None else ():
            behavior = self.map.behaviors.get(active.name)
            if behavior is not None and behavior.pid is not None and active.target is not None:
                targets[behavior.pid.attribute] = (active.target, self.row_of(active.name))
        return targets

    def _sparklines(self, shown: list[int], cells: int) -> list[str]:
        assert self.facts is not None
        assert self._history is not None
        if cells <= 0:
            return [""] * len(shown)
        per_cell = min(max(1, ceil(_SECONDS / self.facts.dt / cells)), _ROWS_KEPT // cells)
        means = self._history.means(cells, per_cell)[:, shown]
        low, high = self._history.low[shown], self._history.high[shown]
        # An angle is scaled to several turns, so that its jump at ±π stays small in the line.
        for column, index in enumerate(shown):
            if self.facts.attributes[index].wraps and np.nanmax(np.abs(means[:, column]), initial=0.0) > 1.5:
                low[column], high[column] = -20 * pi, 20 * pi
        return draw_sparklines(means, low, high)


class AttributeHistory:
    """The last `length` values of each of `columns` attributes, and their range so far."""

    def __init__(self, length: int, columns: int) -> None:
        self._rows = np.full((length, columns), np.nan)
        self.total = 0
        self.low = np.full(columns, np.inf)
        self.high = np.full(columns, -np.inf)

    def extend(self, rows: Floats) -> None:
        """Append rows, shape (n, J)."""
        if not len(rows):
            return
        self.total += len(rows)
        kept = rows[-len(self._rows) :]
        self._rows = np.concatenate([self._rows[len(kept) :], kept])
        self.low = np.fmin(self.low, np.fmin.reduce(rows))
        self.high = np.fmax(self.high, np.fmax.reduce(rows))

    def means(self, cells: int, per_cell: int) -> Floats:
        """Return means of the last cells × per_cell rows, shape (cells, J); NaN where there are no values.

        Cells begin at multiples of `per_cell` since the start, so that means do not change while they
        scroll.
        """
        partial = self.total % per_cell or per_cell
        wanted = (cells - 1) * per_cell + partial
        tail = self._rows[-wanted:]
        missing = cells * per_cell - len(tail)
        head, end = missing - (per_cell - partial), per_cell - partial
        filled = np.pad(tail, ((max(head, 0), end), (0, 0)), constant_values=np.nan)
        groups = filled.reshape(cells, per_cell, -1)
        known = np.isfinite(groups)
        count = known.sum(axis=1)
        total = np.where(known, groups, 0.0).sum(axis=1)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def draw_sparklines(means: Floats, low: Floats, high: Floats) -> list[str]:
    """Return one line of block characters per column of means (cells, J).

    Each is scaled to the values shown, but to no less than a twentieth of the range `low` to `high` seen so
    far, so that noise stays small.
    """
    known = np.isfinite(means)
    bottom = np.where(known, means, np.inf).min(axis=0)
    top = np.where(known, means, -np.inf).max(axis=0)
    with np.errstate(invalid="ignore"):
        least = np.maximum(_LEAST_SHARE * (high - low), 1e-9)
        span = np.maximum(top - bottom, least)
        middle = (top + bottom) / 2
        share = (means - (middle - span / 2)) / span
    level = np.where(known, 1 + np.clip(np.nan_to_num(share) * 8, 0, 7), 0).astype(np.int64)
    text = _LEVELS[level.T]
    return [row.tobytes().decode("utf-32-le") for row in text]
