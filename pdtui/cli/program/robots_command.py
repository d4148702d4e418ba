"""`pdtui robots`: what can be driven."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from pdtui.cli.options.shared_options import json_option
from pdtui.cli.output.command_output import print_result


@click.command()
@json_option
def robots_command(as_json: bool) -> None:
    """List the robots, with the states in which they can start and the maps that there are for them.

    Besides these, any environment that is registered with Gymnasium can be driven and dissected.
    """
    from pdtui.robots import list_robots
    from pdtui.stimulation.map_library import list_maps

    maps: dict[str, list[str]] = {}
    for one in list_maps():
        if one.stimulation_map is not None:
            maps.setdefault(one.stimulation_map.robot, []).append(one.path.stem)
    rows = [{**asdict(robot), "maps": maps.get(robot.name, [])} for robot in list_robots()]
    print_result({"robots": rows}, as_json, lambda: _robots_table(rows))


def _robots_table(rows: list[dict[str, Any]]) -> Any:
    from rich.text import Text

    from pdtui.core.console.text_tables import new_table
    from pdtui.core.printable_text import make_printable

    headings = ("robot", "title", "starts", "maps")
    table = new_table("", *headings, left=headings)
    for row in rows:
        starts = _shorten(row["starts"])
        cells = [row["name"], row["problem"] or row["title"], starts, ", ".join(row["maps"])]
        table.add_row(*(Text(make_printable(cell)) for cell in cells))
    table.columns[0].no_wrap = True
    return table


def _shorten(names: tuple[str, ...], most: int = 6) -> str:
    """Return names as text; of many, the first, the last and how many there are."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 2])}, … {names[-1]} ({len(names)})"
