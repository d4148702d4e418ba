"""The message that a unit was picked with the mouse."""

from __future__ import annotations

from textual.message import Message


class UnitPicked(Message):
    """A unit was clicked, in the strip or in a table.

    Args:
        unit: its flat index.
    """

    def __init__(self, unit: int) -> None:
        super().__init__()
        self.unit = unit
