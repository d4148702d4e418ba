"""Reads maps: TOML files that people edit, checked so that errors name the line and the field."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from pdtui.core.errors import MapError, SeedError
from pdtui.core.reserved_keys import RESERVED_KEYS
from pdtui.core.untrusted_file import MAP_BUDGET, describe_bytes, read_bounded_file
from pdtui.policies.weights.import_options import ACTIVATION_NAMES, SQUASH_NAMES, ImportOptions
from pdtui.robots.options.robot_option import OptionValue
from pdtui.stimulation.behavior_reader import read_behavior, read_primitive
from pdtui.stimulation.interventions.intervention_reader import read_vectors
from pdtui.stimulation.map_table_reader import MapTableReader
from pdtui.stimulation.seed_ranges import merge_seed_ranges, parse_seed_range
from pdtui.stimulation.stimulation_map import SCHEMA, Behavior, StimulationMap

ROBOT_OPTIONS = "robot_options"
"""Name of the table of the robot's options."""
MAX_BEHAVIORS = 1000
"""Largest number of behaviors, and of primitives."""
_MAX_DOTS = 64
_BETWEEN = re.compile(r"[=,{}\[\]\n#]")


def load_map(path: Path) -> StimulationMap:
    """Read a map from a file.

    Raises:
        MapError: The file cannot be read, is not TOML, or has a wrong field; the message names its line.
    """
    try:
        text = read_bounded_file(path, MAP_BUDGET.bytes).decode("utf-8")
    except OSError as error:
        raise MapError(f"{path}: cannot be read as a map: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise MapError(f"{path}: cannot be read as a map: {error}") from error
    return parse_map(text, str(path))


def parse_map(text: str, source: str) -> StimulationMap:
    """Read a map from its text, as `load_map` does from a file; messages call it `source`."""
    if len(text) > MAP_BUDGET.bytes:
        raise MapError(f"{source}: expected a map of at most {describe_bytes(MAP_BUDGET.bytes)}, found more")
    if _has_long_key(text):
        raise MapError(f"{source}: not a map: a key has more than {_MAX_DOTS} parts")
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of too many digits raises a plain ValueError
        raise MapError(f"{source}: not a TOML file: {error}") from error
    top = MapTableReader(source, text, "top level", data, "", 0)
    if (schema := top.take("schema", int)) != SCHEMA:
        raise top.error("schema", f"expected {SCHEMA}, found {schema}")
    robot = top.text("robot")
    policy = MapTableReader(source, text, "policy", top.take("policy", dict), "[policy]", 0)
    name, sha256 = policy.text("name"), policy.text("sha256")
    import_options = ImportOptions(
        policy.choice("activation", ACTIVATION_NAMES, ""),
        policy.choice("squash", SQUASH_NAMES, ""),
        policy.text("normalizer", policy.text("normaliser", "")),  # the spelling of earlier maps
    )
    policy.done()
    keys = MapTableReader(source, text, "keys", top.take("keys", dict, {"default": "space"}), "[keys]", 0)
    default_key = keys.text("default")
    keys.done()
    tables = {
        kind: [
            MapTableReader(source, text, f"{kind[:-1]} {number + 1}", entry, f"[[{kind}]]", number)
            for number, entry in enumerate(top.take(kind, list, []))
        ]
        for kind in ("primitives", "behaviors", "vectors")
    }
    seeds, robot_options = _read_seeds(top), _read_robot_options(top, source, text)
    top.done()
    for kind, entries in tables.items():
        if len(entries) > MAX_BEHAVIORS:
            raise top.error(kind, f"expected at most {MAX_BEHAVIORS} {kind}, found {len(entries)}")
    vectors = {v.name: v for v in map(read_vectors, tables["vectors"])}
    primitives = {p.name: p for p in (read_primitive(table) for table in tables["primitives"])}
    behaviors: dict[str, Behavior] = {}
    for table in tables["behaviors"]:
        behavior = read_behavior(table, primitives, vectors)
        if behavior.name in behaviors:
            raise table.error("name", f"'{behavior.name}' is taken by another behavior")
        behaviors[behavior.name] = behavior
    owners = {default_key: "the default key"}
    for table, behavior in zip(tables["behaviors"], behaviors.values(), strict=True):
        _check_key(table, behavior, owners)
        for other in behavior.together:
            if other not in behaviors:
                raise table.error("together", f"names '{other}', which does not exist")
    return StimulationMap(
        robot,
        name,
        sha256,
        default_key,
        primitives,
        behaviors,
        text,
        source,
        import_options,
        seeds,
        robot_options,
        vectors,
    )


def _read_robot_options(top: MapTableReader, source: str, text: str) -> dict[str, OptionValue]:
    """Read the robot's options; which ones the robot has is known only where it is built."""
    data = top.take(ROBOT_OPTIONS, dict, {})
    return MapTableReader(source, text, ROBOT_OPTIONS, data, f"[{ROBOT_OPTIONS}]", 0).option_values()


def _read_seeds(top: MapTableReader) -> tuple[range, ...] | None:
    """Read the seeds on which anything in the map was chosen."""
    texts = top.take("seeds", list, None)
    if texts is None:
        return None
    try:
        return merge_seed_ranges(parse_seed_range(str(text)) for text in texts)
    except SeedError as error:
        raise top.error("seeds", str(error)) from error


def _has_long_key(text: str) -> bool:
    """Return whether dots join so many parts that parsing, whose time grows with their square, never ends."""
    joined = 0
    for part in text.split("."):
        joined = 0 if not part or _BETWEEN.search(part) else joined + 1
        if joined > _MAX_DOTS:
            return True
    return False


def _check_key(table: MapTableReader, behavior: Behavior, owners: dict[str, str]) -> None:
    """Check that a behavior's key is free, and add it to the owners of keys."""
    key, own = behavior.key, f"behavior '{behavior.name}'"
    if not key:
        raise table.error("key", f"{own}: the key is empty")
    if key in RESERVED_KEYS:
        raise table.error("key", f"{own}: key '{key}' is taken: it {RESERVED_KEYS[key]}")
    if key in owners:
        raise table.error("key", f"key '{key}' is bound to both {owners[key]} and {own}")
    owners[key] = own
