"""`pdtui maps`: the maps in the working directory's folder, and those that come with pdtui."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.options.shared_options import json_option
from pdtui.cli.output.command_output import print_result

if TYPE_CHECKING:
    from pdtui.stimulation.map_library import ListedMap


@click.command()
@json_option
def maps_command(as_json: bool) -> None:
    """List the maps in ./maps, and those that come with pdtui, with their behaviors and keys."""
    from pdtui.stimulation.map_library import list_maps

    rows = [_describe_map(one) for one in list_maps()]
    print_result({"maps": rows}, as_json, lambda: _maps_table(rows))


def _describe_map(listed: ListedMap) -> dict[str, Any]:
    found = listed.stimulation_map
    return {
        "map": listed.path.stem,
        "file": str(listed.path),
        "robot": "" if found is None else found.robot,
        "policy": "" if found is None else found.policy,
        "behaviors": {} if found is None else {one.name: one.key for one in found.behaviors.values()},
        "problem": listed.problem,
    }


def _maps_table(rows: list[dict[str, Any]]) -> Any:
    from rich.text import Text

    from pdtui.core.console.text_tables import new_table
    from pdtui.core.printable_text import make_printable

    headings = ("map", "robot", "policy", "behaviors")
    table = new_table("", *headings, left=headings)
    for row in rows:
        keys = ", ".join(f"{name} ({key})" for name, key in row["behaviors"].items())
        cells = [row["map"], row["robot"], row["policy"], row["problem"] or keys]
        table.add_row(*(Text(make_printable(cell)) for cell in cells))
    table.columns[0].no_wrap = True
    return table
