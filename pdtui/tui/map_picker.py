"""The application that lists the maps and lets the user choose one to drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from pdtui.core.printable_text import make_printable
from pdtui.tui.cell_text import fit_cells
from pdtui.tui.style_sheets import PICKER
from pdtui.tui.theme import THEME, ThemeStyles, theme_styles

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


class MapPickerApp(App[MapPickerRow]):
    """Lets the user choose a map by arrow keys and a filter; `run` returns the chosen row or None.

    Args:
        rows: the maps, in the order to list them.
    """

    CSS = PICKER
    TITLE = "pdtui"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar = [
        Binding("up", "move(-1)", "the map above", id="pick_up", priority=True),
        Binding("down", "move(1)", "the map below", id="pick_down", priority=True),
        Binding("enter", "choose", "drives the selected map", id="pick", priority=True),
        Binding("ctrl+c", "quit", "quits without choosing", id="pick_quit", priority=True),
    ]

    def __init__(self, rows: Sequence[MapPickerRow]) -> None:
        super().__init__()
        self.rows = tuple(rows)
        self.register_theme(THEME)
        self.theme = THEME.name

    def compose(self) -> ComposeResult:
        with Vertical(id="picker") as box:
            box.border_title = "choose a map to drive"
            box.border_subtitle = "↑ ↓ choose   ↵ drive   type to filter   ctrl+c quit"
            yield Input(placeholder="filter: robot, map or policy", id="filter")
            yield OptionList(id="rows", markup=False)
            yield Static(id="none", markup=False)

    def on_mount(self) -> None:
        """List all maps."""
        self._list(self.rows)
        self.query_one(Input).focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """List the rows that contain every word of the filter."""
        words = event.value.lower().split()
        self._list([row for row in self.rows if all(word in _searched(row) for word in words)])

    def action_move(self, direction: int) -> None:
        """Select the next or previous row that can be driven."""
        options = self.query_one(OptionList)
        if direction > 0:
            options.action_cursor_down()
        else:
            options.action_cursor_up()

    def action_choose(self) -> None:
        """Return the selected row."""
        options = self.query_one(OptionList)
        if options.highlighted is not None:
            chosen = options.get_option_at_index(options.highlighted)
            if not chosen.disabled and chosen.id is not None:
                self.exit(self.rows[int(chosen.id)])

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Return the clicked row."""
        if event.option_id is not None:
            self.exit(self.rows[int(event.option_id)])

    def _list(self, rows: Sequence[MapPickerRow]) -> None:
        options = self.query_one(OptionList)
        palette = theme_styles(self.theme_variables)
        options.clear_options()
        options.add_options(
            Option(_prompt(row, palette), id=str(self.rows.index(row)), disabled=bool(row.problem))
            for row in rows
        )
        first = next((index for index, row in enumerate(rows) if not row.problem), None)
        options.highlighted = first
        none = "no maps here yet: dissect a policy first" if not self.rows else "nothing matches the filter"
        self.query_one("#none", Static).update("" if rows else none)


def _searched(row: MapPickerRow) -> str:
    return f"{row.robot} {row.title} {row.map_path} {row.policy}".lower()


def _prompt(row: MapPickerRow, palette: ThemeStyles) -> Text:
    """Return two lines: robot and file, then the number of behaviors or the problem."""
    bad = bool(row.problem)
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(fit_cells(make_printable(row.title), 26), palette.muted if bad else palette.title)
    text.append(f" {make_printable(row.map_path)}\n", palette.muted if bad else palette.primary)
    if bad:
        return text.append(f"  ✗ {make_printable(row.problem)}", palette.bad)
    count = "1 behavior" if row.behaviors == 1 else f"{row.behaviors} behaviors"
    text.append(fit_cells(f"  {count}", 26), palette.good)
    return text.append(f" {make_printable(row.policy)}", palette.muted + Style(italic=True))
