"""Parts of a map's text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit

_ON_ONE_LINE = 5


def inline_table(values: Mapping[str, Any]) -> Any:
    """A table on one line."""
    table = tomlkit.inline_table()
    table.update(values)
    return table


def block_table(values: Mapping[str, Any]) -> Any:
    """A table of its own lines."""
    result = tomlkit.table()
    for key, value in values.items():
        result.add(key, value)
    return result


def outputs_table(values: Mapping[str, float]) -> Any:
    """Units and their outputs: on one line, or a line each where there are many."""
    return inline_table(values) if len(values) <= _ON_ONE_LINE else block_table(values)


def table_array(entries: Sequence[Mapping[str, Any]]) -> Any:
    """Tables under one name; within each, subtables come last, as TOML wants it."""
    result = tomlkit.aot()
    for entry in entries:
        last = {key: value for key, value in entry.items() if isinstance(value, tomlkit.items.Table)}
        result.append(block_table({key: value for key, value in entry.items() if key not in last} | last))
    return result
