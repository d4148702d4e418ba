"""The line under the strip that marks the stimulated units, with their natural and overwritten outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.style import Style
from textual.strip import Strip

from pdtui.core.units import format_unit, split_flat_index
from pdtui.driving.drive_snapshot import StimulatedUnit
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.strip.natural_outputs import NaturalOutputs
from pdtui.tui.theme import STYLES

MAX_MARKED = 16
"""More stimulated units than this are summed up."""


def draw_stimulation_marks(
    units: Sequence[StimulatedUnit],
    layers: Sequence[int],
    width: int,
    column_of: Callable[[int], int],
    style_of: Callable[[int], Style],
    natural: NaturalOutputs,
) -> Strip:
    """Return the line: each unit under its column; ``!`` marks an output that it never has by itself.

    Args:
        units: the stimulated units.
        layers: widths of the layers.
        width: width of the line, in cells.
        column_of: returns the cell under which a unit is marked.
        style_of: returns the style of a unit's behavior.
        natural: what the units put out by themselves.
    """
    texts = {view.unit: _describe(view, layers, natural, ranges=True) for view in units}
    if sum(map(len, texts.values())) > width:
        texts = {view.unit: _describe(view, layers, natural, ranges=False) for view in units}
    marks = sorted((column_of(view.unit), view.unit) for view in units)
    row, hidden = ScreenRow(width), 0
    for index, (column, unit) in enumerate(marks):
        text, at = texts[unit], width - row.left
        rest = sum(len(texts[other]) for _, other in marks[index + 1 :])
        target = max(at, min(column, width - len(text) - rest))
        if target + len(text) > width:
            hidden += 1
            continue
        head, sign, tail = text.partition("!")
        row.add(" " * (target - at), STYLES.text).add(head, style_of(unit)).add(sign + tail, STYLES.warn)
    if hidden and row.left >= 4:
        row.add(f"+{hidden}".rjust(row.left), STYLES.muted)
    return row.strip()


def sum_up_stimulation(units: Sequence[StimulatedUnit], layers: Sequence[int], width: int) -> Strip:
    """Return the line that says how many units of each layer are changed, and how far on average."""
    changes: dict[int, list[float]] = {}
    for view in units:
        layer = split_flat_index(view.unit, layers)[0]
        changes.setdefault(layer, []).append(abs(view.overwritten - view.natural))
    row = ScreenRow(width)
    for layer, sizes in changes.items():
        mean = format_number(sum(sizes) / len(sizes))
        text = f"▲ {len(sizes)} units of layer {layer} changed by {mean} on average  "
        if len(text) <= row.left:
            row.add(text, STYLES.accent)
    return row.strip()


def _describe(view: StimulatedUnit, layers: Sequence[int], natural: NaturalOutputs, *, ranges: bool) -> str:
    address = format_unit(view.unit, layers)
    said = f"▲{address} {format_number(view.natural)}→{format_number(view.overwritten)}"
    if natural.has(view.unit, view.overwritten):
        return f"{said} "
    known = natural.describe_range(view.unit) if ranges else ""
    return f"{said}! ({known}) " if known else f"{said}! "
