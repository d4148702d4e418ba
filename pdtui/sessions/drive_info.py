"""What is known about a drive before its first control step."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

from pdtui.core.attributes import Attribute
from pdtui.core.errors import SessionError
from pdtui.core.robot_links_and_state import Link
from pdtui.core.untrusted_file import MAP_BUDGET
from pdtui.robots.options.robot_option import OptionValue, RobotOptions, require_usable_value
from pdtui.sessions.session_schema import ACTIVATIONS_KEPT, SCHEMA, ActivationsKept


@dataclass(frozen=True)
class BranchOrigin:
    """Where a drive branched off another one, whose control steps before that it begins with.

    Attributes:
        session: name of the other session's file.
        created: date and time at which the other drive began, ISO 8601.
        step: the first control step that is the branch's own.
    """

    session: str
    created: str
    step: int


@dataclass(frozen=True)
class DriveInfo:
    """What is known about a drive before its first control step; with the events, it determines the run.

    Attributes:
        robot: name of the robot.
        seed: seed of the first reset and of every random number.
        policy: name of the policy.
        policy_hash: SHA-256 of the policy's weights.
        map_text: text of the stimulation-evoked map.
        stochastic: whether actions are sampled from the policy's distribution instead of taking its mean.
        start: state in which episodes start; empty for the robot's default.
        dt: simulated time per control step, s.
        attributes, links: kinematic attributes and links of the robot.
        layers: widths of the policy's hidden layers.
        activations: how activations are recorded, which does not affect the run.
        obstacles: whether there are obstacles, and no roads, where the first episode starts: all costs are
            collisions then.
        roads: whether there are roads where the first episode starts.
        robot_options: options that the robot was built with, by name.
        branch: where the drive branched off another one, which does not affect the run; None if it did not.
    """

    robot: str
    seed: int
    policy: str
    policy_hash: str
    map_text: str = field(repr=False)
    stochastic: bool
    dt: float
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    layers: tuple[int, ...]
    activations: ActivationsKept = "all"
    start: str = ""
    obstacles: bool = False
    roads: bool = False
    robot_options: RobotOptions = field(default_factory=dict)
    branch: BranchOrigin | None = None


T = TypeVar("T")
_SIZES = {"capsule": 2, "sphere": 1, "box": 3}
_MAX_LINKS, _MAX_UNITS, _MAX_TEXT, _MAX_OPTIONS = 10_000, 4_000_000, 1000, 100


def encode_drive_info(info: DriveInfo, created: str) -> dict[str, Any]:
    """Return the properties of a drive that began at `created` (ISO 8601); structures are kept as JSON."""
    return {
        "schema": SCHEMA,
        "created": created,
        "robot": info.robot,
        # As text, because a seed may exceed 64 bits.
        "seed": str(info.seed),
        "policy": info.policy,
        "policy_hash": info.policy_hash,
        "stochastic": info.stochastic,
        "start": info.start,
        "obstacles": info.obstacles,
        "roads": info.roads,
        "dt": info.dt,
        "layers": list(info.layers),
        "activations": info.activations,
        "attributes": json.dumps([asdict(attribute) for attribute in info.attributes]),
        "links": json.dumps([asdict(link) for link in info.links]),
        "robot_options": json.dumps(dict(info.robot_options)),
        "map": info.map_text,
        **({} if info.branch is None else {"branch": json.dumps(asdict(info.branch))}),
    }


def decode_drive_info(properties: Mapping[str, list[Any]]) -> tuple[DriveInfo, str]:
    """Return a drive, and the date and time at which it began, trusting nothing in the file.

    Args:
        properties: a list of values for each name, as the file contains them.

    Raises:
        SessionError: a property is missing or invalid; the message names it.
    """
    schema = _read_value(properties, "schema", int)
    if schema != SCHEMA:
        raise SessionError(f"property 'schema': expected {SCHEMA}, found {schema}")
    seed = _read_value(properties, "seed", str)
    if not (seed.isascii() and seed.isdigit() and len(seed) < 100):
        raise SessionError(f"property 'seed': expected a whole number, found '{seed[:40]}'")
    dt = _read_value(properties, "dt", float)
    if not (math.isfinite(dt) and 0 < dt < 1e6):
        raise SessionError(f"property 'dt': expected a positive time in s, found {dt}")
    layers = properties.get("layers", [])
    if not layers or not all(type(width) is int and width > 0 for width in layers):
        raise SessionError("property 'layers': expected the widths of the hidden layers")
    if sum(layers) > _MAX_UNITS:
        raise SessionError(f"property 'layers': expected at most {_MAX_UNITS} units, found {sum(layers)}")
    # Older sessions, which lack the property, contain all activations.
    kept = _read_value(properties, "activations", str, "all")
    if kept not in ACTIVATIONS_KEPT:
        known = ", ".join(ACTIVATIONS_KEPT)
        raise SessionError(f"property 'activations': expected one of {known}, found '{kept[:40]}'")
    info = DriveInfo(
        robot=_read_text(properties, "robot"),
        seed=int(seed),
        policy=_read_text(properties, "policy"),
        policy_hash=_read_text(properties, "policy_hash"),
        map_text=_read_text(properties, "map", MAP_BUDGET.bytes),
        stochastic=_read_value(properties, "stochastic", bool),
        dt=dt,
        attributes=_read_list(properties, "attributes", _decode_attribute),
        links=_read_list(properties, "links", _decode_link),
        layers=tuple(layers),
        activations=kept,
        # Older sessions lack the following properties.
        start=_read_text(properties, "start", default=""),
        obstacles=_read_value(properties, "obstacles", bool, False),
        roads=_read_value(properties, "roads", bool, False),
        robot_options=_read_robot_options(properties),
        branch=_read_branch(properties),
    )
    return info, _read_text(properties, "created")


def _read_value(properties: Mapping[str, list[Any]], name: str, kind: type[T], default: T | None = None) -> T:
    """Return a property of one value; `default` if there is no such property."""
    values = properties.get(name, [] if default is None else [default])
    if not isinstance(values, list) or len(values) != 1 or type(values[0]) is not kind:
        found = "nothing" if not values else f"{type(values[0]).__name__} × {len(values)}"
        raise SessionError(f"property '{name}': expected one {kind.__name__}, found {found}")
    return values[0]


def _read_text(
    properties: Mapping[str, list[Any]], name: str, limit: int = _MAX_TEXT, default: str | None = None
) -> str:
    text = _read_value(properties, name, str, default)
    if len(text) > limit:
        raise SessionError(f"property '{name}': expected at most {limit} characters, found {len(text)}")
    return text


def _read_robot_options(properties: Mapping[str, list[Any]]) -> RobotOptions:
    text = _read_text(properties, "robot_options", _MAX_OPTIONS * _MAX_TEXT, "{}")
    try:
        options = json.loads(text)
        if not isinstance(options, dict) or len(options) > _MAX_OPTIONS:
            raise ValueError(f"expected a table of at most {_MAX_OPTIONS} options")
        if not all(isinstance(value, OptionValue) for value in options.values()):
            raise ValueError("expected texts, numbers, or true or false")
        return {_check_text(name): require_usable_value(value) for name, value in options.items()}
    except (ValueError, OverflowError, RecursionError) as error:
        raise SessionError(f"property 'robot_options': invalid: {error!r}") from error


def _read_branch(properties: Mapping[str, list[Any]]) -> BranchOrigin | None:
    text = _read_text(properties, "branch", 10 * _MAX_TEXT, "")
    try:
        found = json.loads(text) if text else None
        if found is None:
            return None
        step = found["step"]
        if type(step) is not int or not 0 < step < 1 << 40:
            raise ValueError("expected the number of a control step")
        return BranchOrigin(_check_text(found["session"]), _check_text(found["created"]), step)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise SessionError(f"property 'branch': invalid: {error!r}") from error


def _read_list(
    properties: Mapping[str, list[Any]], name: str, build: Callable[[dict[str, Any]], T]
) -> tuple[T, ...]:
    text = _read_text(properties, name, _MAX_LINKS * _MAX_TEXT)
    try:
        items = json.loads(text)
        if not isinstance(items, list) or len(items) > _MAX_LINKS:
            raise ValueError(f"expected a list of at most {_MAX_LINKS} items")
        return tuple(build(item) for item in items)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise SessionError(f"property '{name}': invalid: {error!r}") from error


def _decode_attribute(item: dict[str, Any]) -> Attribute:
    wraps = item["wraps"]
    if type(wraps) is not bool:
        raise ValueError("'wraps' is not a boolean")
    # Older sessions lack the offset.
    scale, offset = _check_numbers([item["scale"], item.get("offset", 0.0)], 2)
    return Attribute(_check_text(item["name"]), _check_text(item["unit"]), scale, wraps, offset)


def _decode_link(item: dict[str, Any]) -> Link:
    shape, body = item["shape"], item["body"]
    if shape not in _SIZES:
        raise ValueError(f"unknown shape {shape!r}")
    if type(body) is not int or not 0 <= body < _MAX_LINKS:
        raise ValueError("'body' is not a row number")
    size = _check_numbers(item["size"], _SIZES[shape])
    x, y, z = _check_numbers(item["position"], 3)
    a, b, c, d = _check_numbers(item["quaternion"], 4)
    return Link(_check_text(item["name"]), body, shape, size, (x, y, z), (a, b, c, d))


def _check_text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"expected text, found {type(value).__name__}")
    if len(value) > _MAX_TEXT:
        raise ValueError(f"expected at most {_MAX_TEXT} characters, found {len(value)}")
    value.encode()  # fails for the lone surrogates that JSON can contain
    return value


def _check_numbers(values: Any, count: int) -> tuple[float, ...]:
    if not isinstance(values, list) or len(values) != count:
        raise ValueError(f"expected {count} numbers")
    if not all(type(value) in (int, float) and math.isfinite(value) for value in values):
        raise ValueError("expected finite numbers")
    return tuple(float(value) for value in values)
