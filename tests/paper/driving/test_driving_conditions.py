"""What is compared, and what cannot be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pdtui.core.errors import MapError, PdtuiError
from pdtui.driving.drive_config import DriveConfig
from pdtui.paper.driving.driving_conditions import evaluate_driving
from pdtui.paper.driving.key_effects import TASKS, driving_behaviors
from pdtui.paper.driving_experiment import POLICIES, list_compared
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map, parse_map

MAP = """
schema = 1
robot = "metadrive"
policy = { name = "metadrive", sha256 = "0" }
keys = { default = "space" }

[[behaviors]]
name = "brake"
key = "s"
says = "brakes"
magnitudes = { "0:1" = 1.0 }

[[behaviors]]
name = "swerve"
key = "a"
says = "moves one lane to the left"
task = "lane left"
magnitudes = { "0:2" = 1.0 }
"""
OWN = DriveConfig("metadrive", parse_map(MAP, "maps/metadrive.toml"), 0)


def test_policies_without_a_map_are_left_out_by_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "maps"
    folder.mkdir()
    (folder / "metadrive-sac.toml").write_text(MAP)
    configs, left_out = list_compared([OWN])
    names = [Path(config.stimulation_map.source).stem for config in configs]
    assert names[:2] == ["metadrive", "metadrive-sac"]
    assert {*names, *left_out} == set(POLICIES)
    for name, reason in left_out.items():
        assert reason.startswith(f"no map '{name}'")


def test_maps_that_are_named_are_compared_alone() -> None:
    other = replace(OWN, stimulation_map=parse_map(MAP, "mine.toml"))
    assert list_compared([other]) == ([other], {})
    assert list_compared([OWN, other]) == ([OWN, other], {})
    assert list_compared([other, other]) == ([other], {})


def test_what_the_operator_needs_is_named() -> None:
    with pytest.raises(MapError, match="missing: accelerate, lane right; the map has brake, lane left"):
        driving_behaviors(OWN.stimulation_map)
    with pytest.raises(PdtuiError, match="test-0 to test-19, found 'traffic'"):
        evaluate_driving([OWN], scenes=["test-1", "traffic"])


@pytest.mark.parametrize("policy", POLICIES)
def test_every_shipped_policy_has_the_keys_that_the_operator_needs(policy: str) -> None:
    assert tuple(driving_behaviors(load_map(find_map(policy)))) == TASKS
