"""The line in which values, names and keys are typed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

from textual.binding import Binding
from textual.widgets import Input

Answer = Callable[[str], str]
"""Takes what was typed, and returns why it cannot be used; an empty text if it can."""


class BenchEntry(Input):
    """A line that is shown only while something is asked.

    Args:
        say: shows what is wrong with what was typed.
        leave: called when the line is no longer shown.
    """

    BINDINGS: ClassVar = [Binding("escape", "leave", "leaves the line", id="entry_leave")]

    def __init__(self, say: Callable[[str], None], leave: Callable[[], None]) -> None:
        super().__init__(id="bench-entry")
        self._say, self._leave = say, leave
        self._answer: Answer = lambda _: ""

    def ask(self, what: str, before: str, answer: Answer) -> None:
        """Let the user type something.

        Args:
            what: what is asked for.
            before: what the line begins with.
            answer: called with what was typed; it may ask something further.
        """
        self._answer, self.placeholder, self.value = answer, what, before
        self.display = True
        self.screen.set_focus(self)  # at once, as further keys may be on their way
        self.cursor_position = len(before)

    def ask_number(self, what: str, before: str, take: Callable[[float], None]) -> None:
        """Let the user type a number, which must be finite."""

        def answer(text: str) -> str:
            try:
                value = float(text.replace("−", "-"))
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                return f"{what}: expected a number, found '{text}'"
            take(value)
            return ""

        self.ask(what, before, answer)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        event.stop()
        asked = self._answer
        if wrong := asked(event.value.strip()):
            self._say(wrong)
        elif self._answer is asked:  # the answer has asked nothing further
            self.action_leave()

    def action_leave(self) -> None:
        """Show the line no longer."""
        self.display = False
        self._leave()
