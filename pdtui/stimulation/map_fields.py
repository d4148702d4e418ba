"""Parts of a map as TOML tables, as they are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

import tomlkit
from tomlkit.items import AoT, InlineTable, Table

from pdtui.core.attributes import BehaviorAim
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.stimulation.interventions.intervention_fields import intervention_fields, onset_fields
from pdtui.stimulation.stimulation_map import Behavior, MeasuredEffect, MotorPrimitive, PidGains

_MAX_INLINE = 5
"""Units that are written on one line; more of them get a line each."""
_OPTIONAL_FIELDS = (
    "says mode period task onset fade magnitudes base commands interventions together pid aim measured"
)
"""Fields of a behavior in the order in which they are written."""


def policy_fields(name: str, sha256: str, import_options: ImportOptions) -> dict[str, Any]:
    """Return the fields of the policy's table. Import options that say nothing are left out."""
    options = {option: value for option, value in asdict(import_options).items() if value}
    return {"name": name, "sha256": sha256, **options}


def primitive_fields(primitive: MotorPrimitive) -> dict[str, Any]:
    """Return the fields of a motor primitive. What is not known is left out."""
    return {name: _to_toml(value) for name, value in vars(primitive).items() if value is not None}


def behavior_fields(behavior: Behavior) -> dict[str, Any]:
    """Return the fields of a behavior. Those that have their default are left out."""
    fields: dict[str, Any] = {"name": behavior.name, "key": behavior.key}
    for name in _OPTIONAL_FIELDS.split():
        value = getattr(behavior, name)
        if name == "interventions" and value:
            fields[name] = _tables_of(map(intervention_fields, value))
        elif name == "onset" and value:
            fields[name] = _inline(onset_fields(value))
        elif value and (name, value) != ("mode", "fixed"):
            fields[name] = _to_toml(value)
    return fields


def _to_toml(value: Any) -> Any:
    if isinstance(value, MeasuredEffect):
        return effect_table(value)
    if isinstance(value, PidGains | BehaviorAim):
        return _inline(asdict(value))
    if isinstance(value, dict):
        return _inline(value) if len(value) <= _MAX_INLINE else table_of(value)
    return list(value) if isinstance(value, tuple) else value


def effect_table(measured: MeasuredEffect) -> InlineTable:
    """Return an effect with four significant digits, and the falls where they were counted."""
    numbers = {name: float(f"{getattr(measured, name):.4g}") for name in ("effect", "low", "high")}
    if measured.falls is None or measured.of is None:
        return _inline(numbers)
    return _inline({**numbers, "falls": measured.falls, "of": measured.of})


def table_of(fields: Mapping[str, Any]) -> Table:
    """Return a table with a line for each field. Subtables come last, as TOML requires."""
    table = tomlkit.table()
    for name, value in sorted(fields.items(), key=lambda field: isinstance(field[1], Table | AoT)):
        table.add(name, value)
    return table


def _tables_of(entries: Iterable[Mapping[str, Any]]) -> AoT:
    """Return an array of tables whose tables of a few numbers are on one line."""
    array = tomlkit.aot()
    for fields in entries:
        array.append(table_of({name: _to_toml(value) for name, value in fields.items()}))
    return array


def _inline(values: Mapping[str, Any]) -> InlineTable:
    table = tomlkit.inline_table()
    table.update(values)
    return table
