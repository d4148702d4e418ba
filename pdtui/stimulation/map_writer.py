"""Writing maps. In a map that somebody edited, everything but the change stays as it was, comments included.

Every text is read again before it is returned, so that what is written is a map.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import tomlkit
from tomlkit.exceptions import TOMLKitError

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.map_toml import (
    array_of,
    behavior_fields,
    effect_table,
    policy_fields,
    primitive_fields,
    table_of,
)
from pdtui.stimulation.stimulation_map import SCHEMA, Behavior, MeasuredEffect, PidGains, StimulationMap

Value = TypeVar("Value")


def compose_map(stimulation_map: StimulationMap, comments: Sequence[str] = ()) -> str:
    """Return the text of a new map.

    Args:
        stimulation_map: What the map holds; its `text` is not used.
        comments: Lines at the top.

    Raises:
        MapError: Something in it is not allowed in a map.
    """
    document = tomlkit.document()
    for line in comments:
        document.add(tomlkit.comment(line))
    document.add("schema", tomlkit.item(SCHEMA))
    document.add("robot", tomlkit.item(stimulation_map.robot))
    policy = stimulation_map.policy, stimulation_map.policy_hash, stimulation_map.import_options
    document.add("policy", table_of(policy_fields(*policy)))
    document.add("keys", table_of({"default": stimulation_map.default_key}))
    if primitives := [primitive_fields(one) for one in stimulation_map.primitives.values()]:
        document.add("primitives", array_of(primitives))
    if behaviors := [behavior_fields(one) for one in stimulation_map.behaviors.values()]:
        document.add("behaviors", array_of(behaviors))
    text = tomlkit.dumps(document)
    parse_map(text, stimulation_map.source)
    return text


def replace_effects(text: str, measured: Mapping[str, MeasuredEffect], source: str) -> str:
    """Return the text of a map with other measured effects.

    Args:
        text: The map.
        measured: Effects by the names of their behaviors.
        source: Name of the map in messages.

    Raises:
        MapError: The text is no map, or it lacks one of the behaviors.
    """

    def replace(behavior: Any, effect: MeasuredEffect) -> None:
        behavior["measured"] = effect_table(effect)

    return _edit_behaviors(text, source, measured, replace)


def replace_gains(text: str, gains: Mapping[str, PidGains], source: str) -> str:
    """Return the text of a map with other gains and limits of behaviors of mode ``pid``.

    Args:
        text: The map.
        gains: Controllers by the names of their behaviors.
        source: Name of the map in messages.

    Raises:
        MapError: As `replace_effects`, or a behavior has another mode.
    """

    def replace(behavior: Any, pid: PidGains) -> None:
        if "pid" not in behavior:
            raise MapError(f"{source}: behavior '{behavior['name']}': expected mode pid, found fixed")
        behavior["pid"].update({name: getattr(pid, name) for name in ("kp", "ki", "kd", "limit")})

    return _edit_behaviors(text, source, gains, replace)


def replace_policy(text: str, name: str, import_options: ImportOptions, source: str) -> str:
    """Return the text of a map that names its policy's file otherwise. The hash stays.

    Args:
        text: The map.
        name: Weights file, or name of a shipped policy.
        import_options: Answers to what the weights file does not state.
        source: Name of the map in messages.

    Raises:
        MapError: The text is no map.
    """

    def replace(document: Any) -> None:
        policy = document["policy"]
        policy.update(policy_fields(name, policy["sha256"], import_options))

    return _edit(text, source, replace)


def add_behavior(text: str, behavior: Behavior, source: str) -> str:
    """Return the text of a map with one more behavior, or with a new one in place of that of the same name.

    Args:
        text: The map.
        behavior: The behavior. One that takes another's place keeps the other's key.
        source: Name of the map in messages.

    Raises:
        MapError: The text is no map, or the behavior does not fit into it.
    """
    fields = behavior_fields(behavior)

    def add(document: Any) -> None:
        behaviors = document.setdefault("behaviors", tomlkit.aot())
        table = next((one for one in behaviors if one["name"] == behavior.name), None)
        if table is None:
            behaviors.append(table_of(fields))
            return
        for name in [name for name in table if name not in ("name", "key")]:
            del table[name]
        for name, value in table_of(fields).items():
            if name not in ("name", "key"):
                table[name] = value

    return _edit(text, source, add)


def rewrite_map(path: Path, change: Callable[[str], str]) -> None:
    """Replace the text of a map's file by what `change` makes of it, atomically.

    Raises:
        MapError: What `change` raises, or the file cannot be read or written.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error.strerror}") from error
    write_file(path, change(text), MapError)


def _edit_behaviors(
    text: str, source: str, values: Mapping[str, Value], replace: Callable[[Any, Value], None]
) -> str:
    def edit(document: Any) -> None:
        tables = {str(table["name"]): table for table in document.get("behaviors", [])}
        for name, value in values.items():
            if name not in tables:
                raise MapError(f"{source}: no behavior '{name}'; there are {', '.join(tables) or 'none'}")
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
