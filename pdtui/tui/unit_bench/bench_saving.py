"""Saves what the bench holds as a behavior of the map, and the gains of controllers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pdtui.core.atomic_file import write_file
from pdtui.core.attributes import BehaviorAim
from pdtui.core.errors import MapError
from pdtui.core.reserved_keys import RESERVED_KEYS
from pdtui.core.units import describe_units, format_unit
from pdtui.driving.drive_snapshot import DriveFacts
from pdtui.stimulation.map_library import user_map_path
from pdtui.stimulation.map_writer import add_behavior, add_seeds, compose_map, replace_gains, rewrite_map
from pdtui.stimulation.stimulation_map import Behavior, PidGains, StimulationMap
from pdtui.tui.cell_text import format_signed
from pdtui.tui.unit_bench.ghost_differences import GhostDifferences

_KEY = re.compile(r"[A-Za-z0-9]|[a-z][a-z0-9_+]+")
_TOLD = 6  # attributes with the largest differences that a comment tells


@dataclass(frozen=True)
class MeasuredDifferences:
    """What was measured against the ghost, as a comment of the map and as an aim.

    Attributes:
        comments: lines of the comment.
        aim: the change of the attribute that differs most; None if nothing was measured.
    """

    comments: tuple[str, ...]
    aim: BehaviorAim | None = None


def describe_measurement(facts: DriveFacts, differences: GhostDifferences) -> MeasuredDifferences:
    """Return what the ghost showed of the units that are held: one run, so no confidence interval."""
    found = f"Found on the unit bench: {facts.title}, seed {facts.seed}."
    means, ranked = differences.means(), differences.ranked()
    if means is None or not ranked:
        return MeasuredDifferences((found, "Nothing was measured, as there was no ghost."))
    attributes = facts.attributes
    told = ", ".join(
        f"{attributes[column].name} {format_signed(float(means[column]))} {attributes[column].unit}"
        for column in ranked[:_TOLD]
    )
    first, steps = differences.first, differences.steps
    over = f"Means over {steps} control steps from step {first} on, compared with the ghost, in this one run:"
    top = ranked[0]
    aim = BehaviorAim(attributes[top].name, "raise" if means[top] > 0 else "lower")
    return MeasuredDifferences((found, over, f"{told}."), aim)


def check_behavior_name(stimulation_map: StimulationMap, name: str) -> str:
    """Return why a new behavior cannot have a name; an empty text if it can."""
    if not name:
        return "expected a name"
    return f"there is a behavior '{name}' already" if name in stimulation_map.behaviors else ""


def check_behavior_key(stimulation_map: StimulationMap, key: str) -> str:
    """Return why a new behavior cannot have a key; an empty text if it can."""
    if not _KEY.fullmatch(key):
        return f"expected a letter, a digit or the name of a key, found '{key}'"
    if key in RESERVED_KEYS:
        return f"key '{key}' is taken: it {RESERVED_KEYS[key]}"
    if key == stimulation_map.default_key:
        return f"key '{key}' is taken: it clears everything"
    owner = stimulation_map.behavior_of_key(key)
    return "" if owner is None else f"key '{key}' is taken by '{owner.name}'"


def build_bench_behavior(
    name: str, key: str, held: Mapping[int, float], layers: tuple[int, ...], aim: BehaviorAim | None
) -> Behavior:
    """Return a behavior that holds units, by flat index, at outputs v."""
    magnitudes = {format_unit(unit, layers): value for unit, value in held.items()}
    return Behavior(name, key, f"holds {describe_units(magnitudes)}", magnitudes, aim=aim)


def save_behavior(
    stimulation_map: StimulationMap, facts: DriveFacts, behavior: Behavior, comments: tuple[str, ...]
) -> Path:
    """Write a behavior into the map of a drive, whose comments are kept, and return the file.

    Of a map that comes with pdtui, a copy is written into ``./maps``; a drive without a map gets a new one.

    Raises:
        MapError: The map cannot be changed, or the file cannot be written.
    """

    def add(text: str, source: str) -> str:
        return add_behavior(text, behavior, source, comments)

    return _change_map(stimulation_map, facts, add)


def save_gains(
    stimulation_map: StimulationMap, facts: DriveFacts, name: str, pid: PidGains, seeds: range | None
) -> Path:
    """Write the gains and the limit of a behavior into the map of a drive, and return the file.

    The same as `save_behavior` goes for the file. If there are `seeds`, the gains were chosen on them.
    """

    def change(text: str, source: str) -> str:
        changed = replace_gains(text, {name: pid}, source)
        return changed if seeds is None else add_seeds(changed, [seeds], source)

    return _change_map(stimulation_map, facts, change)


def _change_map(
    stimulation_map: StimulationMap, facts: DriveFacts, change: Callable[[str, str], str]
) -> Path:
    path = Path(stimulation_map.source)
    if path.is_file():
        output = user_map_path(path)
        output.parent.mkdir(parents=True, exist_ok=True)
        source = str(path)
        rewrite_map(path, lambda text: change(text, source), output)
        return output
    output = Path("maps") / f"{stimulation_map.robot}-bench.toml"
    if output.exists():
        raise MapError(f"{output}: already exists; drive with --map {output} to change it")
    named = replace(stimulation_map, policy_hash=facts.policy_hash, source=str(output))
    output.parent.mkdir(parents=True, exist_ok=True)
    text = compose_map(named, ("Written by the unit bench of `pdtui drive`.",))
    write_file(output, change(text, str(output)), MapError)
    return output
