"""The application that lists the maps and lets the user choose one to drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding

from pdtui.core.printable_text import make_printable
from pdtui.tui.cell_text import fit_cells
from pdtui.tui.choice_list import ChoiceList, ListChoice, has_all_words
from pdtui.tui.theme import STYLES, THEME
from pdtui.tui.themes.themed_app import ThemedApp

if TYPE_CHECKING:
    from pdtui.stimulation.map_library import ListedMap


@dataclass(frozen=True)
class MapPickerRow:
    """One map in the list, or a map file that cannot be read.

    Attributes:
        robot: name of the robot.
        title: display name of the robot.
        map_path: the map file.
        policy: the policy that the map was made for.
        behaviors: number of behaviors in the map.
        problem: why the map cannot be driven; empty if it can.
    """

    robot: str
    title: str
    map_path: str
    policy: str = ""
    behaviors: int = 0
    problem: str = ""

    def __str__(self) -> str:
        """Return the map file, which is how a command line names the row."""
        return self.map_path


def map_picker_rows(maps: Sequence[ListedMap]) -> list[MapPickerRow]:
    """Return one row per map; of a broken map only the file name is known."""
    rows = []
    for listed in maps:
        found = listed.stimulation_map
        if found is None:
            rows.append(MapPickerRow("", listed.path.stem, str(listed.path), problem=listed.problem))
        else:
            rows.append(
                MapPickerRow(found.robot, found.robot, str(listed.path), found.policy, len(found.behaviors))
            )
    return rows


class MapPickerApp(ThemedApp[MapPickerRow]):
    """Lets the user choose a map by arrow keys and a filter; `run` returns the chosen row or None."""

    CSS = """
    Screen { align: center middle; background: $background; }
    ChoiceList { width: 92; height: auto; }
    """
    TITLE = "pdtui"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar = [Binding("ctrl+c", "quit", "quits without choosing", id="pick_quit", priority=True)]

    def __init__(self, rows: Sequence[MapPickerRow], theme: str = THEME.name) -> None:
        super().__init__(theme)
        self.rows = tuple(rows)

    def compose(self) -> ComposeResult:
        yield ChoiceList(
            "choose a map to drive",
            "↑ ↓ choose   ↵ drive   type to filter   ctrl+c quit",
            "filter: robot, map or policy",
            self._find_rows,
            nothing_found="nothing matches the filter",
            nothing_there="no maps here yet: dissect a policy first",
        )

    def _find_rows(self, query: str) -> list[ListChoice]:
        return [
            ListChoice(_prompt(row), row, disabled=bool(row.problem))
            for row in self.rows
            if has_all_words(f"{row.robot} {row.title} {row.map_path} {row.policy}", query)
        ]

    def on_choice_list_chosen(self, event: ChoiceList.Chosen) -> None:
        self.exit(event.value)


def _prompt(row: MapPickerRow) -> Text:
    """Return two lines: robot and file, then the number of behaviors or the problem."""
    bad = bool(row.problem)
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(fit_cells(make_printable(row.title), 26), STYLES.muted if bad else STYLES.title)
    text.append(f" {make_printable(row.map_path)}\n", STYLES.muted if bad else STYLES.primary)
    if bad:
        return text.append(f"  ✗ {make_printable(row.problem)}", STYLES.bad)
    count = "1 behavior" if row.behaviors == 1 else f"{row.behaviors} behaviors"
    text.append(fit_cells(f"  {count}", 26), STYLES.good)
    return text.append(f" {make_printable(row.policy)}", STYLES.muted + Style(italic=True))
