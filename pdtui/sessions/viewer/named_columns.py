"""The control steps as a table whose columns have names, for the viewer's dataframe view."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.step_record import StepRecord
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import TABLE
from pdtui.sessions.viewer.viewer_curves import SendRows
from pdtui.sessions.writer.arrow_columns import ComponentColumn, number_list_column, stack_rows, text_column


class NamedColumnWriter:
    """Writes attributes, reward, cost, action, episode and latched behaviors of each step, each in a column.

    Numbers are float32 there. The drive itself has them in lists, where the view would number them: a column
    of its own takes a hundred bytes per batch, which only the large batches of the viewer's data can afford.
    Activations stay in their list, as hundreds of columns could not be read.
    """

    def __init__(self, info: DriveInfo, send: SendRows) -> None:
        self._send, self._pending = send, list[StepRecord]()
        named = [f"{one.name} ({one.unit})" if one.unit else one.name for one in info.attributes]
        self._attributes = [_as_component(name) for name in named]

    def add(self, records: Sequence[StepRecord]) -> None:
        """Add control steps."""
        self._pending += records

    def write(self) -> None:
        """Write what was added since the last call."""
        if not self._pending:
            return
        attributes = stack_rows([record.attributes for record in self._pending]).astype(np.float32)
        columns = _name_columns(self._attributes, attributes)
        for name in ("reward", "cost"):
            values = np.array([getattr(record, name) for record in self._pending], np.float32)
            columns.append(number_list_column(name, values))
        actions = stack_rows([record.action for record in self._pending]).astype(np.float32)
        columns += _name_columns([f"action {number}" for number in range(actions.shape[1])], actions)
        episodes = np.array([record.episode for record in self._pending], np.int64)
        columns.append(number_list_column("episode", episodes))
        latched = (", ".join(one.name for one in record.behaviors) for record in self._pending)
        columns.append(text_column("behaviors", list(latched)))
        self._send(TABLE, [record.step for record in self._pending], columns)
        self._pending = []


def _name_columns(
    names: Sequence[str], block: np.ndarray[tuple[int, ...], np.dtype[np.float32]]
) -> list[ComponentColumn]:
    return [
        number_list_column(name, np.ascontiguousarray(block[:, column])) for column, name in enumerate(names)
    ]


def _as_component(name: str) -> str:
    """Return a name without the colon, which would separate an archetype from its component."""
    return name.replace(":", "·")
