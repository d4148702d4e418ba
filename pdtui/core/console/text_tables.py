"""Tables for the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from rich.table import Table
from rich.text import Text


def new_table(title: str, *columns: str, left: Sequence[str] | None = None) -> Table:
    """Return an empty table; one without a title has no lines around its cells.

    Args:
        title: title above the table, or an empty string.
        columns: column headings.
        left: headings of the columns that are aligned left; None for the first column only.
    """
    table = Table(title=title or None, title_justify="left", caption_justify="left", header_style="bold")
    if not title:
        table.box, table.pad_edge = None, False
    for number, column in enumerate(columns):
        is_left = column in left if left is not None else number == 0
        table.add_column(column, justify="left" if is_left else "right", overflow="fold")
    return table


def new_facts_table(facts: Iterable[tuple[str, str | Text]]) -> Table:
    """Return a table of names and values, without headings."""
    table = Table(box=None, pad_edge=False, show_header=False)
    for name, value in facts:
        table.add_row(Text(name, "dim"), value)
    return table


def format_seed_range(seeds: Sequence[int]) -> str:
    return f"{len(seeds)} seeds, {seeds[0]}–{seeds[-1]}" if len(seeds) > 1 else f"seed {seeds[0]}"


def format_mean_with_interval(mean: float, low: float, high: float, form: str = ".2f") -> str:
    """Return a mean and its interval as text; without the interval where a single value gave none."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return f"{mean:{form}}"
    return f"{mean:{form}} [{low:{form}}, {high:{form}}]"


def format_p_value(value: float) -> str:
    """Return a p-value with two digits, or that it is below 0.001."""
    return f"{value:.2g}" if value >= 0.001 else "< 0.001"
