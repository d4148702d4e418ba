"""Tables for the terminal."""

from __future__ import annotations

from rich.table import Table


def new_table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left")
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number == 0 else "right", no_wrap=number == 0)
    return table


def seed_range(seeds: tuple[int, ...]) -> str:
    return f"{len(seeds)} seeds, {seeds[0]}–{seeds[-1]}"
