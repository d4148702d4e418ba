"""A list of choices that typing filters and the arrow keys move through."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.message import Message
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

MAX_CHOICES = 200
"""More than anybody reads; a list of thousands would slow down typing."""


class ListChoice(Option):
    """One choice: the text that the list shows, and the value that choosing it gives."""

    def __init__(self, prompt: Text, value: Any, *, disabled: bool = False) -> None:
        super().__init__(prompt, disabled=disabled)
        self.value = value


class ChoiceList(Vertical):
    """Typing filters, the arrows move, and enter or a click posts a `ChoiceList.Chosen` message.

    Args:
        title: what is chosen.
        keys: the keys and what they do, for the lower edge of the frame.
        placeholder: shown in the filter while nothing is typed.
        find_choices: returns the choices that fit what was typed.
        nothing_found: shown where no choice fits.
        nothing_there: shown where there is no choice even without a filter.
    """

    DEFAULT_CSS = """
    ChoiceList {
        max-width: 100%;
        max-height: 100%;
        border: round $primary;
        border-title-color: $primary;
        border-title-style: bold;
        border-subtitle-color: $foreground 60%;
        background: $surface;
        padding: 0 1;
    }
    #filter {
        height: 2;
        border: none;
        border-bottom: solid $foreground 22%;
        padding: 0 1;
        background: $surface;
    }
    #choices { border: none; height: auto; max-height: 1fr; background: $surface; padding: 0; }
    #choices > .option-list--option { padding: 0 1; }
    #choices > .option-list--option-highlighted { background: $primary 28%; text-style: none; }
    #choices > .option-list--option-disabled { text-opacity: 100%; }
    #none { height: auto; color: $foreground 60%; padding: 0 1; }
    """
    BINDINGS: ClassVar = [
        Binding("up", "move(-1)", "the choice above", priority=True, id="list_up"),
        Binding("down", "move(1)", "the choice below", priority=True, id="list_down"),
        Binding("enter", "choose", "takes the marked choice", priority=True, id="list_choose"),
    ]

    @dataclass
    class Chosen(Message):
        """A choice with this value was made."""

        value: Any

    def __init__(
        self,
        title: str,
        keys: str,
        placeholder: str,
        find_choices: Callable[[str], Iterable[ListChoice]],
        *,
        nothing_found: str,
        nothing_there: str = "",
    ) -> None:
        super().__init__()
        self.border_title, self.border_subtitle = title, keys
        self._placeholder, self._find_choices = placeholder, find_choices
        self._nothing_found, self._nothing_there = nothing_found, nothing_there

    def compose(self) -> ComposeResult:
        yield Input(placeholder=self._placeholder, id="filter")
        yield OptionList(id="choices", markup=False)
        yield Static(id="none", markup=False)

    def on_mount(self) -> None:
        self._show_choices("")
        self.query_one(Input).focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        self._show_choices(event.value)

    def action_move(self, direction: int) -> None:
        """Mark the next or the previous choice that is not disabled."""
        options = self.query_one(OptionList)
        if direction > 0:
            options.action_cursor_down()
        else:
            options.action_cursor_up()

    def action_choose(self) -> None:
        """Take the marked choice."""
        self.query_one(OptionList).action_select()

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        event.stop()
        assert isinstance(event.option, ListChoice)
        self.post_message(self.Chosen(event.option.value))

    def _show_choices(self, query: str) -> None:
        choices = list(islice(self._find_choices(query), MAX_CHOICES))
        options = self.query_one(OptionList)
        options.clear_options()
        options.add_options(choices)
        options.action_first()
        message = self._nothing_found if query else self._nothing_there
        self.query_one("#none", Static).update("" if choices else message)


def has_all_words(text: str, query: str) -> bool:
    """Return whether a text contains every word of a query, in any case."""
    return all(word in text.lower() for word in query.lower().split())
