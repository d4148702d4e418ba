"""The overlay that finds something in the guide: text, a link or a heading."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from pdtui.tui.theme import theme_styles

MAX_CHOICES = 200
"""More than anybody reads; a list of thousands would slow down typing."""


@dataclass(frozen=True)
class GuideChoice:
    """Something to go to.

    Attributes:
        text: what it says.
        place: where it stands, or where it leads; may be empty.
        target: the link that leads there.
    """

    text: str
    place: str
    target: str


ChoiceFinder = Callable[[str], Sequence[GuideChoice]]
"""From what was typed to the choices that fit."""


class GuideChooser(ModalScreen[str | None]):
    """Typing filters, the arrows move, enter chooses; the result is a link, or None.

    Args:
        title: what is chosen.
        find: gives the choices for what was typed.
    """

    BINDINGS: ClassVar = [
        Binding("up", "move(-1)", "the choice above", priority=True, id="guide_up"),
        Binding("down", "move(1)", "the choice below", priority=True, id="guide_down"),
        Binding("enter", "choose", "goes there", priority=True, id="guide_choose"),
        Binding("escape", "dismiss(None)", "closes the list", priority=True, id="guide_close"),
    ]

    def __init__(self, title: str, find: ChoiceFinder) -> None:
        super().__init__()
        self._title, self._find = title, find
        self._choices: Sequence[GuideChoice] = ()

    def compose(self) -> ComposeResult:
        with Vertical(id="chooser") as box:
            box.border_title = self._title
            box.border_subtitle = "↑ ↓ choose   ↵ go there   type to filter   esc close"
            yield Input(placeholder="words to find", id="query")
            yield OptionList(id="choices", markup=False)

    def on_mount(self) -> None:
        """List what is there before anything is typed."""
        self._list("")

    def on_input_changed(self, event: Input.Changed) -> None:
        """List what fits."""
        self._list(event.value)

    def action_move(self, direction: int) -> None:
        """Mark the next choice."""
        options = self.query_one(OptionList)
        if direction > 0:
            options.action_cursor_down()
        else:
            options.action_cursor_up()

    def action_choose(self) -> None:
        """Close with the marked choice."""
        marked = self.query_one(OptionList).highlighted
        if marked is not None:
            self.dismiss(self._choices[marked].target)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Close with the choice that was clicked."""
        event.stop()
        self.dismiss(self._choices[event.option_index].target)

    def _list(self, query: str) -> None:
        self._choices = self._find(query)[:MAX_CHOICES]
        styles = theme_styles(self.app.theme_variables)
        options = self.query_one(OptionList)
        options.clear_options()
        for choice in self._choices:
            prompt = Text(choice.text, styles.text, no_wrap=True, overflow="ellipsis")
            if choice.place:
                prompt.append(f"\n  {choice.place}", styles.muted)
            options.add_option(Option(prompt))
        options.highlighted = 0 if self._choices else None
        if query and not self._choices:
            options.add_option(Option(Text("nothing has all of these words", styles.muted), disabled=True))
