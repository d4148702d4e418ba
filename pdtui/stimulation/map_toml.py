"""The TOML tables of a map, as pdtui writes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import tomlkit
from tomlkit.items import AoT, InlineTable, Table

from pdtui.policies.weights.import_options import ImportOptions
from pdtui.stimulation.stimulation_map import Behavior, MeasuredEffect, MotorPrimitive

_MAX_INLINE = 5
"""Units that are written on one line; more of them get a line each."""


def policy_fields(name: str, sha256: str, import_options: ImportOptions) -> dict[str, Any]:
    """Return the fields of the policy's table. Import options that say nothing are left out."""
    options = {option: value for option, value in asdict(import_options).items() if value}
    return {"name": name, "sha256": sha256, **options}


def primitive_fields(primitive: MotorPrimitive) -> dict[str, Any]:
    """Return the fields of a motor primitive. What is not known is left out."""
    fields = {name: value for name, value in vars(primitive).items() if value is not None}
    if primitive.measured is not None:
        fields["measured"] = effect_table(primitive.measured)
    return fields


def behavior_fields(behavior: Behavior) -> dict[str, Any]:
    """Return the fields of a behavior. Those that have their default are left out."""
    fields: dict[str, Any] = {"name": behavior.name, "key": behavior.key}
    if behavior.says:
        fields["says"] = behavior.says
    if behavior.mode != "fixed":
        fields["mode"] = behavior.mode
    if behavior.period is not None:
        fields["period"] = behavior.period
    if behavior.task:
        fields["task"] = behavior.task
    for name in ("magnitudes", "base", "commands"):
        if values := getattr(behavior, name):
            fields[name] = _inline(values) if len(values) <= _MAX_INLINE else table_of(values)
    if behavior.together:
        fields["together"] = list(behavior.together)
    for name in ("pid", "aim"):
        if (part := getattr(behavior, name)) is not None:
            fields[name] = _inline(asdict(part))
    if behavior.measured is not None:
        fields["measured"] = effect_table(behavior.measured)
    return fields


def effect_table(measured: MeasuredEffect) -> InlineTable:
    """Return an effect with four significant digits, and the falls where they were counted."""
    numbers = {name: float(f"{getattr(measured, name):.4g}") for name in ("effect", "low", "high")}
    if measured.falls is None or measured.of is None:
        return _inline(numbers)
    return _inline({**numbers, "falls": measured.falls, "of": measured.of})


def table_of(fields: Mapping[str, Any]) -> Table:
    """Return a table with a line for each field. Subtables come last, as TOML requires."""
    table = tomlkit.table()
    for name, value in sorted(fields.items(), key=lambda field: isinstance(field[1], Table)):
        table.add(name, value)
    return table


def array_of(tables: Sequence[Mapping[str, Any]]) -> AoT:
    """Return tables that share one name."""
    array = tomlkit.aot()
    for fields in tables:
        array.append(table_of(fields))
    return array


def _inline(values: Mapping[str, Any]) -> InlineTable:
    table = tomlkit.inline_table()
    table.update(values)
    return table
