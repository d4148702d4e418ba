"""The home screen: everything that can be opened, found by typing and opened with enter."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.screen import Screen
from textual.widgets import Static

from pdtui.core.printable_text import make_printable
from pdtui.tui.cell_text import fit_cells
from pdtui.tui.choice_list import ChoiceList, ListChoice, has_all_words
from pdtui.tui.home.home_contents import HomeContents
from pdtui.tui.home.home_rows import (
    HomeRow,
    list_home_rows,
    list_robot_rows,
    list_session_rows,
    list_start_rows,
)
from pdtui.tui.theme import STYLES, THEME
from pdtui.tui.themes.themed_app import ThemedApp

_NAME = 26  # cells


class HomeApp(ThemedApp[HomeRow]):
    """Lists what can be opened; `run` returns the row that was chosen, or None.

    Args:
        contents: what there is to open.
        theme: name of the theme.
        notice: what the user should read first, such as why the last drive ended.
    """

    CSS = """
    HomeScreen { align: center middle; background: $background; }
    HomeScreen ChoiceList { width: 92; height: 1fr; }
    HomeScreen #notice { width: 92; max-width: 100%; height: auto; max-height: 3; padding: 0 2; }
    """
    TITLE = "pdtui"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar = [Binding("ctrl+c", "quit", "quits", id="home_quit", priority=True)]

    def __init__(self, contents: HomeContents, theme: str = THEME.name, notice: str = "") -> None:
        super().__init__(theme)
        self.contents, self._notice = contents, notice

    def on_mount(self) -> None:
        rows = list(list_home_rows(self.contents))
        self.push_screen(HomeScreen("pdtui", rows, "quit", self._notice))

    def open_row(self, row: HomeRow) -> None:
        """Open another list, or end with the row."""
        if row.opens == "robot":
            rows = list(list_robot_rows(self.contents, row.robot))
            # A list of one map would only be in the way.
            if len(rows) == 1:
                self.open_row(rows[0])
            else:
                self.push_screen(HomeScreen(f"maps of {row.robot}", rows))
        elif row.opens == "map":
            rows = list(list_start_rows(self.contents, row))
            self.push_screen(HomeScreen(f"where {row.robot} starts", rows))
        elif row.opens == "session":
            self.push_screen(HomeScreen(row.name, list(list_session_rows(row.path))))
        else:
            self.exit(row)

    def go_back(self) -> None:
        """Go back to the list before; from the first one, quit."""
        if len(self.screen_stack) > 2:
            self.pop_screen()
        else:
            self.exit()


class HomeScreen(Screen[None]):
    """One list, with what the user should read below it."""

    BINDINGS: ClassVar = [Binding("escape", "back", "goes back", id="home_back")]

    def __init__(self, title: str, rows: Sequence[HomeRow], escape: str = "back", notice: str = "") -> None:
        super().__init__()
        self._heading, self._rows, self._escape, self._notice = make_printable(title), rows, escape, notice

    def compose(self) -> ComposeResult:
        yield ChoiceList(
            self._heading,
            f"↑ ↓ choose   ↵ open   type to filter   esc {self._escape}",
            "filter",
            self._find_rows,
            nothing_found="nothing matches the filter",
            nothing_there="nothing here yet",
        )
        notice = Text(make_printable(self._notice), STYLES.warn)
        shown = Static(notice, id="notice", markup=False)
        shown.display = bool(self._notice)
        yield shown

    def _find_rows(self, query: str) -> Iterable[ListChoice]:
        found = [row for row in self._rows if has_all_words(f"{row.section} {row.name} {row.says}", query)]
        for section, rows in groupby(found, lambda row: row.section):
            if section:
                yield ListChoice(Text(make_printable(section), STYLES.accent), None, disabled=True)
            for row in rows:
                yield ListChoice(_prompt(row), row, disabled=bool(row.problem))

    def on_choice_list_chosen(self, event: ChoiceList.Chosen) -> None:
        app = self.app
        assert isinstance(app, HomeApp)
        app.open_row(event.value)

    def action_back(self) -> None:
        """Go back."""
        app = self.app
        assert isinstance(app, HomeApp)
        app.go_back()


def _prompt(row: HomeRow) -> Text:
    text = Text(no_wrap=not row.problem, overflow="ellipsis")
    text.append(
        f"  {fit_cells(make_printable(row.name), _NAME)} ", STYLES.muted if row.problem else STYLES.title
    )
    if row.problem:
        return text.append(make_printable(row.problem), STYLES.warn)
    return text.append(make_printable(row.says), STYLES.muted)
