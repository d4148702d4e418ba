"""In the maps that come with pdtui, a key does the same kind of thing on every robot."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import pytest

from pdtui.stimulation.map_library import shipped_folder
from pdtui.stimulation.map_reader import load_map

KEYS = {
    "a": ("left",),
    "d": ("right",),
    "j": ("sidestep left", "drift left", "asked left"),
    "l": ("sidestep right", "drift right", "asked right"),
    "w": ("forward", "faster", "hurry", "accelerate", "up"),
    "s": ("brake", "slow to", "down"),
    "x": ("stop", "stand"),
    "i": ("jump",),
    "h": ("hold heading",),
    "g": ("hold speed",),
}
"""Words that a behavior's name has where it has the key."""
MAPS = sorted(shipped_folder("maps").glob("*.toml"))


def test_a_behavior_has_the_same_key_in_every_map() -> None:
    keys: dict[str, set[str]] = defaultdict(set)
    for path in MAPS:
        for behavior in load_map(path).behaviors.values():
            keys[behavior.name].add(behavior.key)
    assert {name: found for name, found in keys.items() if len(found) > 1} == {}


@pytest.mark.parametrize("path", MAPS, ids=lambda path: path.stem)
def test_a_key_does_what_it_does_on_other_robots(path: Path) -> None:
    shipped = load_map(path)
    assert shipped.default_key == "space"
    for behavior in shipped.behaviors.values():
        if behavior.key in KEYS:
            assert any(word in behavior.name for word in KEYS[behavior.key]), behavior.name
