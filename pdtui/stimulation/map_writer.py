"""Writing maps. In a map that somebody edited, everything but the change stays as it was, comments included.

Every text is read again before it is returned, so that what is written is a map; a `MapError` names the map
as `source` and says what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import tomlkit
from tomlkit.exceptions import TOMLKitError

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.robots.options.robot_option import RobotOptions
from pdtui.stimulation.interventions.intervention_fields import vectors_fields
from pdtui.stimulation.map_fields import (
    behavior_fields,
    effect_table,
    policy_fields,
    primitive_fields,
    table_of,
)
from pdtui.stimulation.map_reader import ROBOT_OPTIONS, parse_map
from pdtui.stimulation.seed_ranges import format_seed_ranges, merge_seed_ranges, parse_seed_range
from pdtui.stimulation.stimulation_map import SCHEMA, Behavior, MeasuredEffect, PidGains, StimulationMap

Value = TypeVar("Value")
_HEADER = re.compile(r"^[ \t]*\[", re.MULTILINE)
_POLICY_HEADER = re.compile(r"[ \t]*\[[ \t]*[\"']?policy[\"']?[ \t]*\]")
_MAX_POLICY_PART = 20_000
"""Characters of the table of the policy, or of the map up to its first table."""


def compose_map(stimulation_map: StimulationMap, comments: Sequence[str] = ()) -> str:
    """Return the text of a new map with comments at the top; its own `text` is not used."""
    document = tomlkit.document()
    for line in comments:
        document.add(tomlkit.comment(line))
    document.add("schema", tomlkit.item(SCHEMA))
    document.add("robot", tomlkit.item(stimulation_map.robot))
    if stimulation_map.seeds:
        document.add("seeds", tomlkit.item(format_seed_ranges(stimulation_map.seeds)))
    if stimulation_map.robot_options:
        document.add(ROBOT_OPTIONS, table_of(stimulation_map.robot_options))
    policy = stimulation_map.policy, stimulation_map.policy_hash, stimulation_map.import_options
    document.add("policy", table_of(policy_fields(*policy)))
    document.add("keys", table_of({"default": stimulation_map.default_key}))
    primitives = [primitive_fields(one) for one in stimulation_map.primitives.values()]
    behaviors = [behavior_fields(one) for one in stimulation_map.behaviors.values()]
    vectors = [vectors_fields(one) for one in stimulation_map.vectors.values()]
    for name, tables in (("vectors", vectors), ("primitives", primitives), ("behaviors", behaviors)):
        array = tomlkit.aot()
        for fields in tables:
            array.append(table_of(fields))
        if tables:
            document.add(name, array)
    text = tomlkit.dumps(document)
    parse_map(text, stimulation_map.source)
    return text


def replace_effects(text: str, measured: Mapping[str, MeasuredEffect], source: str) -> str:
    """Return the text of a map with other measured effects of behaviors, given by name."""

    def replace(behavior: Any, effect: MeasuredEffect) -> None:
        behavior["measured"] = effect_table(effect)

    return _edit_behaviors(text, source, measured, replace)


def replace_gains(text: str, gains: Mapping[str, PidGains], source: str) -> str:
    """Return the text of a map with other gains and limits of behaviors of mode ``pid``, given by name."""

    def replace(behavior: Any, pid: PidGains) -> None:
        if "pid" not in behavior:
            raise MapError(f"{source}: behavior '{behavior['name']}': expected mode pid, found fixed")
        behavior["pid"].update({name: getattr(pid, name) for name in ("kp", "ki", "kd", "limit")})

    return _edit_behaviors(text, source, gains, replace)


def replace_policy(text: str, name: str, import_options: ImportOptions, source: str) -> str:
    """Return the text of a map that names another weights file or shipped policy. The hash stays."""

    parse_map(text, source)
    # Only the part with the policy is parsed by tomlkit, which takes seconds for a large map.
    headers = [match.start() for match in _HEADER.finditer(text)]
    parts = list(pairwise([0, *headers, len(text)]))
    start, end = next((one for one in parts if _POLICY_HEADER.match(text, *one)), parts[0])
    try:
        if end - start > _MAX_POLICY_PART:
            raise KeyError("policy")
        part = tomlkit.parse(text[start:end])
        policy: Any = part["policy"]
        policy.pop("normaliser", None)  # the spelling of earlier maps
        policy.update(policy_fields(name, policy["sha256"], import_options))
    except (TOMLKitError, KeyError, AttributeError) as error:
        raise MapError(f"{source}: expected the policy in a table [policy] of its own") from error
    changed = f"{text[:start]}{tomlkit.dumps(part)}{text[end:]}"
    parse_map(changed, source)
    return changed


def replace_robot_options(text: str, options: RobotOptions, source: str) -> str:
    """Return the text of a map with other options of the robot."""

    def replace(document: Any) -> None:
        document.pop(ROBOT_OPTIONS, None)
        if options:
            document.add(ROBOT_OPTIONS, table_of(options))

    return _edit(text, source, replace)


def add_behavior(text: str, behavior: Behavior, source: str, comments: Sequence[str] = ()) -> str:
    """Return the text of a map with one more behavior; one of the same name is replaced but keeps its key.

    A new behavior begins with the comments.
    """
    fields = behavior_fields(behavior)

    def add(document: Any) -> None:
        behaviors = document.setdefault("behaviors", tomlkit.aot())
        table = next((one for one in behaviors if one["name"] == behavior.name), None)
        if table is None:
            table = tomlkit.table()
            for line in comments:
                table.add(tomlkit.comment(line))
            for name, value in table_of(fields).items():
                table.add(name, value)
            behaviors.append(table)
            return
        for name in [name for name in table if name not in ("name", "key")]:
            del table[name]
        for name, value in table_of(fields).items():
            if name not in ("name", "key"):
                table[name] = value

    return _edit(text, source, add)


def add_seeds(text: str, seeds: Iterable[int | range], source: str) -> str:
    """Return the text of a map that also records these seeds, on which something in it was chosen."""

    def add(document: Any) -> None:
        before = [parse_seed_range(str(one)) for one in document.get("seeds", [])]
        ranges = format_seed_ranges(merge_seed_ranges([*before, *seeds]))
        if "seeds" in document:
            document["seeds"] = tomlkit.item(ranges)
        else:
            document.add("seeds", tomlkit.item(ranges))

    return _edit(text, source, add)


def rewrite_map(path: Path, change: Callable[[str], str], output: Path | None = None) -> None:
    """Write what `change` makes of the text of a map into its file or into `output`, atomically."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error.strerror}") from error
    write_file(output or path, change(text), MapError)


def _edit_behaviors(
    text: str, source: str, values: Mapping[str, Value], replace: Callable[[Any, Value], None]
) -> str:
    def edit(document: Any) -> None:
        tables = {str(table["name"]): table for table in document.get("behaviors", [])}
        for name, value in values.items():
            if name not in tables:
                raise MapError(f"{source}: no behavior '{name}'; available: {', '.join(tables) or 'none'}")
            replace(tables[name], value)

    return _edit(text, source, edit)


def _edit(text: str, source: str, change: Callable[[Any], None]) -> str:
    parse_map(text, source)
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise MapError(f"{source}: not a TOML file: {error}") from error
    change(document)
    changed = tomlkit.dumps(document)
    parse_map(changed, source)
    return changed
