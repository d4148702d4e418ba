"""Differences in the streams of which a step has any number of values: behaviors, stimulation, takeover."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.sessions.session_schema import ACTIVE_FIELDS
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.streams.value_differences import StreamDifference, StreamValue, differing_values

_EXACT_FIELDS = ("remaining", "factor", "waiting")
"""Fields of an active behavior that no rounding affects."""


def find_behavior_difference(
    here: StepBlock, recorded: StepBlock, tolerance: float | None
) -> StreamDifference | None:
    """Return the first difference of the active behaviors and their controllers; None if there is none."""
    row = _first_unequal_row(
        (here.behavior_counts, here.behavior_row_indices, here.behavior_names),
        (recorded.behavior_counts, recorded.behavior_row_indices, recorded.behavior_names),
    )
    count = _elements_before(here.behavior_row_indices, row)
    exact = np.array([name in _EXACT_FIELDS for name in ACTIVE_FIELDS])
    a, b = here.behavior_states[:count], recorded.behavior_states[:count]
    wrong = differing_values(a, b, tolerance)
    if tolerance is not None:
        wrong[:, exact] = differing_values(a[:, exact], b[:, exact], None)
    if wrong.any():
        element, field = divmod(int(wrong.argmax()), len(ACTIVE_FIELDS))
        column = f"'{here.behavior_names[element]}' {ACTIVE_FIELDS[field]}"
        values = (_none_for_nan(block[element, field].item()) for block in (a, b))
        return StreamDifference(
            int(here.steps[here.behavior_row_indices[element]]), "behaviors", column, *values
        )
    if row is None:
        return None
    names = (
        " + ".join(np.array(one.behavior_names, object)[one.behavior_row_indices == row]) or "none"
        for one in (here, recorded)
    )
    return StreamDifference(int(here.steps[row]), "behaviors", "", *names)


def find_stimulation_difference(
    here: StepBlock, recorded: StepBlock, unit: Callable[[int], str], tolerance: float | None
) -> StreamDifference | None:
    """Return the first difference of the stimulated units and their outputs; None if there is none."""
    tables = [(one.stimulated_counts, one.stimulated_row_indices, one.stimulated) for one in (here, recorded)]
    names = ("stimulated units", "overwritten", "natural")
    return _find_table_difference(here.steps, tables[0], tables[1], names, unit, tolerance)


def first_takeover_difference(
    here: StepBlock, recorded: StepBlock, tolerance: float | None
) -> StreamDifference | None:
    """Return the first difference of what the operator had taken over; None if there is none."""
    tables = [(one.replaced_counts, one.replaced_row_indices, one.replaced) for one in (here, recorded)]
    names = ("components taken over", "policy's action")
    return _find_table_difference(here.steps, tables[0], tables[1], names, str, tolerance)


_Table = tuple[NDArray[np.int64], NDArray[np.int64], Floats]


def _find_table_difference(
    steps: NDArray[np.int64],
    a: _Table,
    b: _Table,
    names: Sequence[str],
    label: Callable[[int], str],
    tolerance: float | None,
) -> StreamDifference | None:
    """Return the first difference of two tables, of which the first column says what a row is about.

    The names are those of the first column as a whole and of each of the others.
    """
    (counts_a, rows, first), (counts_b, other_rows, second) = a, b
    row = _first_unequal_row((counts_a, rows, first[:, 0]), (counts_b, other_rows, second[:, 0]))
    count = _elements_before(rows, row)
    wrong = differing_values(first[:count], second[:count], tolerance)
    if wrong.any():
        element, field = divmod(int(wrong.argmax()), len(names))
        values = first[element, field].item(), second[element, field].item()
        return StreamDifference(
            int(steps[rows[element]]), names[field], label(int(first[element, 0])), *values
        )
    if row is None:
        return None
    about = (
        " ".join(label(int(one)) for one in table[places == row, 0]) or "none"
        for table, places in ((first, rows), (second, other_rows))
    )
    return StreamDifference(int(steps[row]), names[0], "", *about)


_Ragged = tuple[NDArray[np.int64], NDArray[np.int64], Sequence[Any] | NDArray[Any]]


def _first_unequal_row(a: _Ragged, b: _Ragged) -> int | None:
    """Return the first row of which the numbers of elements or their names differ; None if there is none."""
    (counts_a, rows, names_a), (counts_b, _, names_b) = a, b
    unequal = np.flatnonzero(counts_a != counts_b)
    row = int(unequal[0]) if unequal.size else None
    count = _elements_before(rows, row)
    first, second = names_a[:count], names_b[:count]
    wrong = np.flatnonzero(np.asarray(first, object) != np.asarray(second, object))
    return int(rows[wrong[0]]) if wrong.size else row


def _elements_before(rows: NDArray[np.int64], row: int | None) -> int:
    return len(rows) if row is None else int(np.searchsorted(rows, row))


def _none_for_nan(value: float) -> StreamValue:
    return "none" if math.isnan(value) else value
