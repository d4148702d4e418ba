from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import NO_OPTIONS
from pdtui.stimulation.map_library import shipped_folder
from pdtui.stimulation.map_reader import load_map, parse_map
from pdtui.stimulation.map_writer import (
    add_behavior,
    compose_map,
    replace_effects,
    replace_gains,
    replace_policy,
    rewrite_map,
)
from pdtui.stimulation.stimulation_map import Behavior, MeasuredEffect, PidGains, StimulationMap

EDITED = "# my own remark\n"
FIGURES = {"push": MeasuredEffect(1.23456, 1.0, 1.5, 2, 20)}


def test_a_composed_map_reads_back_as_what_it_was_made_of(map_text: str) -> None:
    text = map_text.replace('mode = "pid"', 'mode = "pid"\nbase = { "0:5" = 0.5 }\ncommands = { pace = 0.5 }')
    options = '[robot_options]\nforward = "x"\nlegs = 4\nweight = 0.5\nstrong = true\n\n'
    text = text.replace("[keys]", f'activation = "relu"\n\n{options}[keys]').replace(
        '"push"]\n', '"push"]\ntask = "hop"\n'
    )
    maps = [parse_map(text, "m"), *(load_map(path) for path in shipped_folder("maps").glob("*.toml"))]
    assert len(maps) > 5
    assert maps[0].robot_options == {"forward": "x", "legs": 4, "weight": 0.5, "strong": True}
    for one in maps:
        composed = compose_map(one, ["first", "second"])
        assert composed.startswith("# first\n# second\nschema = 1\n")
        again = parse_map(composed, one.source)
        assert replace(again, text="", vectors={}) == replace(one, text="", vectors={})
        assert list(again.vectors) == list(one.vectors)
        for name, vectors in one.vectors.items():
            assert again.vectors[name].layer == vectors.layer
            np.testing.assert_array_equal(again.vectors[name].rows, vectors.rows)
        assert again.behaviors.keys() == one.behaviors.keys()
        assert list(again.behaviors) == list(one.behaviors)


def test_what_is_no_map_is_not_written(small_map: StimulationMap) -> None:
    twice = {"push": small_map.behaviors["push"], "pull": replace(small_map.behaviors["push"], name="pull")}
    with pytest.raises(MapError, match="key 'w' is bound to both behavior 'push' and behavior 'pull'"):
        compose_map(replace(small_map, behaviors=twice))
    with pytest.raises(MapError, match="key 'w' is bound to both"):
        add_behavior(small_map.text, twice["pull"], "m")
    with pytest.raises(MapError, match=r"m: not a TOML file"):
        replace_policy("policy = ", "ant", NO_OPTIONS, "m")


def test_a_behavior_is_added_or_replaced_and_comments_stay(map_text: str) -> None:
    text = map_text.replace('key = "w"', 'key = "k"  # nearer')
    many = {f"0:{unit}": float(unit) for unit in range(9)}
    added = add_behavior(text, Behavior("hop", "j", "hops", many, period=0.5, task="hop"), "m")
    assert added.startswith(text.rstrip())
    assert parse_map(added, "m").behaviors["hop"].magnitudes == many
    changed = add_behavior(added, Behavior("push", "p", "", {"0:1": 1.0}), "m")
    assert 'key = "k"  # nearer' in changed
    assert parse_map(changed, "m").behaviors["push"] == Behavior("push", "k", "", {"0:1": 1.0})
    assert list(parse_map(changed, "m").behaviors) == ["push", "twitch", "hold heading", "hop"]


def test_figures_come_in_and_comments_stay(map_text: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = EDITED + map_text.replace('key = "w"', 'key = "k"  # nearer')
    path.write_text(text)
    rewrite_map(path, lambda text: replace_effects(text, FIGURES, str(path)))
    assert load_map(path).behaviors["push"].measured == MeasuredEffect(1.235, 1.0, 1.5, 2, 20)
    added = [line for line in path.read_text().splitlines() if line not in text.splitlines()]
    assert added == ["measured = {effect = 1.235, low = 1.0, high = 1.5, falls = 2, of = 20}"]
    assert set(text.splitlines()) <= set(path.read_text().splitlines())


def test_measuring_again_replaces_only_the_figure(map_text: str) -> None:
    once = replace_effects(map_text, FIGURES, "m.toml")
    twice = replace_effects(once, {"push": MeasuredEffect(0.5, 0.4, 0.6)}, "m.toml")
    changed = [pair for pair in zip(once.splitlines(), twice.splitlines(), strict=True) if pair[0] != pair[1]]
    assert [new for _, new in changed] == ["measured = {effect = 0.5, low = 0.4, high = 0.6}"]


def test_a_behavior_that_the_map_does_not_have_is_named(map_text: str) -> None:
    with pytest.raises(
        MapError, match=r"m\.toml: no behavior 'dance'; available: push, twitch, hold heading"
    ):
        replace_effects(map_text, {"dance": FIGURES["push"]}, "m.toml")


def test_gains_come_in_and_comments_stay(map_text: str) -> None:
    text = EDITED + map_text.replace('mode = "pid"', 'mode = "pid"  # it holds')
    changed = replace_gains(text, {"hold heading": PidGains("yaw", 5.0, 0.25, 0.5, 1.5, 9.0)}, "mine")
    assert parse_map(changed, "mine").behaviors["hold heading"].pid == PidGains(
        "yaw", 5.0, 0.25, 0.5, 1.5, 0.1
    )
    old, new = text.splitlines(), changed.splitlines()
    assert [line for line in new if "pid = " not in line] == [line for line in old if "pid = " not in line]
    with pytest.raises(MapError, match="mine: behavior 'push': expected mode pid, found fixed"):
        replace_gains(text, {"push": PidGains("yaw", 1.0, 0.0, 0.0, 1.0, 0.1)}, "mine")
    with pytest.raises(MapError, match="mine: no behavior 'hop'"):
        replace_gains(text, {"hop": PidGains("yaw", 1.0, 0.0, 0.0, 1.0, 0.1)}, "mine")
