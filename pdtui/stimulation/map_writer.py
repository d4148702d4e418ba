"""New figures and behaviors in a map that somebody edited: everything else stays as it was written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import tomlkit

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import MapError
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import MeasuredEffect, PidGains

Value = TypeVar("Value")


def effect_table(measured: MeasuredEffect) -> tomlkit.items.InlineTable:
    """An effect as maps hold it: four digits, and the falls where they were counted."""
    table = tomlkit.inline_table()
    for name in ("effect", "low", "high"):
        table[name] = float(f"{getattr(measured, name):.4g}")
    if measured.falls is not None and measured.of is not None:
        table.update({"falls": measured.falls, "of": measured.of})
    return table


def replace_effects(text: str, measured: Mapping[str, MeasuredEffect], source: str) -> str:
    """The map's text with what was measured of its behaviors; comments, order and layout stay.

    Args:
        text: of a map.
        measured: effects by the names of behaviors.
        source: of the text, for messages.

    Raises:
        MapError: the text is no map, or has no such behavior.
    """

    def write(table: Any, value: MeasuredEffect) -> None:
        table["measured"] = effect_table(value)

    return _with_fields(text, measured, write, source)


def replace_gains(text: str, gains: Mapping[str, PidGains], source: str) -> str:
    """The map's text with other gains and limits of behaviors of mode ``pid``; everything else stays.

    Args:
        text: of a map.
        gains: controllers by the names of behaviors.
        source: of the text, for messages.

    Raises:
        MapError: as `replace_effects`, or a behavior of another mode.
    """

    def write(table: Any, pid: PidGains) -> None:
        if "pid" not in table:
            raise MapError(f"{source}: behavior '{table['name']}': expected mode pid, found fixed")
        table["pid"].update({name: getattr(pid, name) for name in ("kp", "ki", "kd", "limit")})

    return _with_fields(text, gains, write, source)


def _with_fields(
    text: str, values: Mapping[str, Value], write: Callable[[Any, Value], None], source: str
) -> str:
    known = parse_map(text, source).behaviors
    missing = [name for name in values if name not in known]
    if missing:
        raise MapError(f"{source}: no behavior '{missing[0]}'; there are {', '.join(known)}")
    document = tomlkit.parse(text)
    for table in document.get("behaviors", []):
        if table["name"] in values:
            write(table, values[table["name"]])
    changed = tomlkit.dumps(document)
    parse_map(changed, source)
    return changed


def add_behavior(text: str, entry: Mapping[str, Any], source: str) -> str:
    """The map's text with one behavior more, or with a new one in place of that of the same name.

    Args:
        text: of a map.
        entry: the behavior's fields, as the map is to hold them; ``name`` and ``key`` among them. A behavior
            that is replaced keeps its key.
        source: of the text, for messages.

    Raises:
        MapError: the text is no map, or is none any more with the behavior.
    """
    parse_map(text, source)
    document = tomlkit.parse(text)
    behaviors = document.setdefault("behaviors", tomlkit.aot())
    table = next((one for one in behaviors if one["name"] == entry["name"]), None)
    if table is None:
        table = tomlkit.table()
        behaviors.append(table)
        table["name"], table["key"] = entry["name"], entry["key"]
    for field in [name for name in table if name not in ("name", "key")]:
        del table[field]
    for field, value in entry.items():
        if field not in ("name", "key"):
            table[field] = value
    changed = tomlkit.dumps(document)
    parse_map(changed, source)
    return changed


def write_effects(path: Path, measured: Mapping[str, MeasuredEffect]) -> None:
    """Write figures into a map's file, in one step.

    Raises:
        MapError: as `replace_effects`, or the file cannot be written.
    """
    rewrite_map(path, lambda text: replace_effects(text, measured, str(path)))


def rewrite_map(path: Path, change: Callable[[str], str]) -> None:
    """Replace a map's text, in one step.

    Raises:
        MapError: what `change` raises, or the file cannot be read or written.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error.strerror}") from error
    write_file(path, change(text), MapError)
