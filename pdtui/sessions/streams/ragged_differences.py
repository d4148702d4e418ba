"""Differences in the streams of which a control step has any number of values: behaviors and stimulation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.sessions.session_schema import ACTIVE_FIELDS
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.streams.value_differences import StreamDifference, StreamValue, differing_values

_EXACT_FIELDS = ("remaining", "factor")
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
    row = _first_unequal_row(
        (here.stimulated_counts, here.stimulated_row_indices, here.stimulated[:, 0]),
        (recorded.stimulated_counts, recorded.stimulated_row_indices, recorded.stimulated[:, 0]),
    )
    count = _elements_before(here.stimulated_row_indices, row)
    a, b = here.stimulated[:count], recorded.stimulated[:count]
    wrong = differing_values(a, b, tolerance)
    if wrong.any():
        element, field = divmod(int(wrong.argmax()), 3)
        step = int(here.steps[here.stimulated_row_indices[element]])
        values = a[element, field].item(), b[element, field].item()
        return StreamDifference(
            step, ("", "overwritten", "natural")[field], unit(int(a[element, 0])), *values
        )
    if row is None:
        return None
    units = (
        " ".join(unit(int(flat)) for flat in one.stimulated[one.stimulated_row_indices == row, 0]) or "none"
        for one in (here, recorded)
    )
    return StreamDifference(int(here.steps[row]), "stimulated units", "", *units)


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
