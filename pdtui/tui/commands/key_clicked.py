"""The message that a click on a drawn key, or on what it does, means that key."""

from __future__ import annotations

from dataclasses import dataclass

from textual.message import Message


@dataclass
class KeyClicked(Message):
    """The key was clicked; it does what pressing it does."""

    key: str
