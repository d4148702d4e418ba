"""What commands print: a result as a table or as JSON."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from pdtui.core.printable_text import to_json

_UNCUT = 10_000
"""Columns that are wide enough for every table."""


def describe_map_copy(path: Path, output: Path) -> str:
    """Return what to add where a changed map was written into another file than its own."""
    return "" if output == path else f"; it is a copy, since {path} comes with pdtui and is not changed"


def print_result(
    data: dict[str, Any] | list[dict[str, Any]], as_json: bool, table: Callable[[], Any]
) -> None:
    """Print the data as JSON, or the table."""
    if as_json:
        click.echo(to_json(data))
        return
    from rich.console import Console

    # Names in tables come from maps and sessions, so nothing in them is markup. A file or a pipe is as wide
    # as the widest table: only a terminal needs lines to be cut or folded.
    told = sys.stdout.isatty() or "COLUMNS" in os.environ
    Console(markup=False, emoji=False, width=None if told else _UNCUT).print(table())
