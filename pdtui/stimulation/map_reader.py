"""Reads maps: TOML files that people edit, checked so that errors name the line and the field."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import cast, get_args

from pdtui.core.attributes import AimDirection, BehaviorAim
from pdtui.core.errors import MapError, SeedError
from pdtui.core.reserved_keys import RESERVED_KEYS
from pdtui.core.units import ADDRESS
from pdtui.core.untrusted_file import MAP_BUDGET, describe_bytes, read_bounded_file
from pdtui.policies.weights.import_options import ACTIVATION_NAMES, SQUASH_NAMES, ImportOptions
from pdtui.robots.options.robot_option import OptionValue
from pdtui.stimulation.interventions.intervention import LayerVectors
from pdtui.stimulation.interventions.intervention_reader import read_interventions, read_onset, read_vectors
from pdtui.stimulation.map_table_reader import MapTableReader
from pdtui.stimulation.seed_ranges import merge_seed_ranges, parse_seed_range
from pdtui.stimulation.stimulation_map import (
    SCHEMA,
    Behavior,
    BehaviorMode,
    MeasuredEffect,
    MotorPrimitive,
    PidGains,
    StimulationMap,
)

ROBOT_OPTIONS = "robot_options"
"""Name of the table of the robot's options."""
MAX_BEHAVIORS = 1000
"""Largest number of behaviors, and of primitives."""
MAX_PERIOD = 1e6
"""Longest activation period, s: eleven days."""
MAX_FADE = 60.0
"""Longest time over which interventions fade, s."""
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
        policy.text("normaliser", ""),
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
    primitives = {p.name: p for p in (_read_primitive(table) for table in tables["primitives"])}
    behaviors: dict[str, Behavior] = {}
    for table in tables["behaviors"]:
        behavior = _read_behavior(table, primitives, vectors)
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


def _read_primitive(table: MapTableReader) -> MotorPrimitive:
    unit = table.text("unit")
    if not ADDRESS.fullmatch(unit):
        raise table.error("unit", f"expected layer:index, such as 0:12, found '{unit}'")
    name, attribute, rho = table.text("name"), table.text("attribute"), table.number("rho")
    discrepancy, value = table.number("discrepancy", None), table.number("value", None)
    if not -1.0 <= rho <= 1.0:
        raise table.error("rho", f"expected a number from −1 to 1, found {rho}")
    primitive = MotorPrimitive(name, attribute, unit, rho, discrepancy, value, _read_effect(table))
    table.done()
    return primitive


def _read_effect(parent: MapTableReader) -> MeasuredEffect | None:
    table = parent.table("measured", None)
    if table is None:
        return None
    effect, low, high = map(table.number, ("effect", "low", "high"))
    measured = MeasuredEffect(effect, low, high, table.take("falls", int, None), table.take("of", int, None))
    table.done()
    return measured


def _read_behavior(
    table: MapTableReader, primitives: dict[str, MotorPrimitive], vectors: dict[str, LayerVectors]
) -> Behavior:
    name = table.text("name")
    magnitudes = table.numbers("magnitudes", {})
    for key in magnitudes:
        if key not in primitives and not ADDRESS.fullmatch(key):
            known = ", ".join(primitives) or "none"
            raise table.error(
                "magnitudes", f"'{key}' is neither a layer:index nor a primitive; available: {known}"
            )
    commands = table.numbers("commands", {})
    interventions, onset = read_interventions(table, vectors), read_onset(table)
    if not magnitudes and not commands and not interventions:
        raise table.error("magnitudes", "expected at least one unit")
    period = table.number("period", None)
    if period is not None and not 0 < period <= MAX_PERIOD:
        raise table.error("period", f"expected more than 0 and at most {MAX_PERIOD:g} s, found {period}")
    together = table.take("together", list, [])
    if not all(isinstance(other, str) for other in together):
        raise table.error("together", "expected names of behaviors")
    mode = cast(BehaviorMode, table.choice("mode", ("fixed", "pid"), "fixed"))
    aim_table, aim = table.table("aim", None), None
    if aim_table is not None:
        direction = cast(AimDirection, aim_table.choice("direction", get_args(AimDirection)))
        aim = BehaviorAim(aim_table.text("attribute"), direction)
        aim_table.done()
    pid_table, pid = table.table("pid", None), None
    if (pid_table is not None) != (mode == "pid"):
        raise table.error("pid", 'expected with mode = "pid", and only there')
    base = table.numbers("base", {})
    if base and mode != "pid":
        raise table.error("base", 'expected only with mode = "pid"')
    for key in base:
        if not ADDRESS.fullmatch(key):
            raise table.error("base", f"'{key}': expected layer:index, such as 0:12")
    if pid_table is not None:
        gains = {name: pid_table.number(name) for name in ("kp", "ki", "kd", "limit", "step")}
        pid = PidGains(attribute=pid_table.text("attribute"), **gains)
        if pid.limit <= 0:
            raise pid_table.error("limit", f"expected more than 0, found {pid.limit}")
        pid_table.done()
    behavior = Behavior(
        name=name,
        key=table.text("key"),
        says=table.text("says", ""),
        magnitudes=magnitudes,
        base=base,
        period=period,
        together=tuple(together),
        mode=mode,
        aim=aim,
        measured=_read_effect(table),
        pid=pid,
        task=table.text("task", ""),
        commands=commands,
        interventions=interventions,
        onset=onset,
        fade=_read_fade(table, bool(interventions)),
    )
    table.done()
    return behavior


def _read_fade(table: MapTableReader, fades: bool) -> float:
    fade: float = table.number("fade", 0.0)
    if not 0.0 <= fade <= MAX_FADE or (fade and not fades):
        raise table.error(
            "fade", f"expected 0 to {MAX_FADE:g} s, and interventions that can fade, found {fade:g}"
        )
    return fade


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
