"""Maps on disk: what is read, and how mistakes are named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pdtui.core.attributes import BehaviorAim
from pdtui.core.errors import MapError
from pdtui.stimulation.map_library import find_map, list_maps, map_without_behaviors
from pdtui.stimulation.map_reader import load_map, parse_map
from pdtui.stimulation.stimulation_map import MeasuredEffect, PidGains, StimulationMap


def test_a_map_is_read_whole(small_map: StimulationMap, map_text: str) -> None:
    assert small_map.text == map_text
    assert list(small_map.behaviors) == ["push", "twitch", "hold heading"]
    push, twitch, hold = small_map.behaviors.values()
    assert push.aim == BehaviorAim("vy", "increase")
    assert small_map.units_of(push) == {"0:3": 4.0 * -0.5, "1:7": 2.0}
    assert twitch.period == 0.5
    assert twitch.together == ("push",)
    assert hold.pid == PidGains("yaw", 2.0, 0.1, 0.05, 3.0, 0.1)
    assert small_map.primitives["sway"].measured == MeasuredEffect(0.4, 0.1, 0.7)
    assert small_map.behavior_of_key("t") is twitch


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema = 1", "schema = 2", r"m\.toml:1: top level: field 'schema': expected 1, found 2"),
        ('unit = "0:3"', 'unit = "zero"', r"m\.toml:14: primitive 1: field 'unit': expected layer:index"),
        ("rho = -0.5", "rho = -1.5", r"m\.toml:15: .*'rho': expected a number from −1 to 1"),
        ("rho = -0.5", "rho = nan", r"m\.toml:15: .*'rho': expected a finite number"),
        ("rho = -0.5", 'rho = "x"', r"m\.toml:15: .*'rho': expected a number, found text"),
        (
            "sway = 4.0",
            "swat = 4.0",
            r"m\.toml:23: behavior 1: field 'magnitudes': 'swat' is neither .*; available: sway",
        ),
        (
            "period = 0.5",
            "period = 0",
            r"m\.toml:31: behavior 2: field 'period': expected more than 0 and at most",
        ),
        ("period = 0.5", "perod = 0.5", r"m\.toml:31: behavior 2: field 'perod': not a field"),
        (
            'key = "t"',
            'key = "w"',
            r"m\.toml:28: .*key 'w' is bound to both behavior 'push' and behavior 'twitch'",
        ),
        ('key = "t"', 'key = "space"', "key 'space' is bound to both the default key and behavior 'twitch'"),
        ('key = "t"', 'key = "q"', "behavior 'twitch': key 'q' is taken: it ends the drive and quits"),
        ('name = "twitch"', 'name = "push"', r"m\.toml:27: .*'push' is taken by another behavior"),
        (
            'together = ["push"]',
            'together = ["gone"]',
            r"m\.toml:32: .*'together': names 'gone', which does not exist",
        ),
        (
            'mode = "pid"',
            'mode = "magic"',
            r"m\.toml:38: .*'mode': expected one of fixed, pid, found 'magic'",
        ),
        ('mode = "pid"\n', "", r"field 'pid': expected with mode"),
        ("limit = 3.0", "limit = 0.0", r"m\.toml:40: behavior 3, pid: field 'limit': expected more than 0"),
        ('says = "pushes"', 'says = "\\u001b[31m"', r"m\.toml:22: .*'says': expected printable text"),
        ('robot = "ant"\n', "", r"field 'robot': missing"),
        ("[keys]", "[keys", "not a TOML file"),
        (
            "[keys]",
            "[robot_options]\nforward = []\n[keys]",
            r"m\.toml:9: robot_options: field 'forward': expected text, a number, or true or false",
        ),
        (
            "[keys]",
            "[robot_options]\nforward = inf\n[keys]",
            r"m\.toml:9: robot_options: field 'forward': expected a finite number",
        ),
    ],
)
def test_mistakes_name_line_and_field(map_text: str, old: str, new: str, message: str) -> None:
    assert old in map_text
    with pytest.raises(MapError, match=message):
        parse_map(map_text.replace(old, new, 1), "m.toml")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"gone\.toml"):
        load_map(tmp_path / "gone.toml")


def test_a_map_of_another_policy_is_refused_unless_forced(small_map: StimulationMap) -> None:
    with pytest.raises(MapError, match=r"made for a policy with SHA-256 .*, the policy here has "):
        small_map.check("ant", (16, 16), "0" * 64)
    small_map.check("ant", (16, 16), "0" * 64, force=True)
    with pytest.raises(
        MapError, match="behavior 'push': unit 1:7 does not exist; the policy has layers 0..1 of 4"
    ):
        small_map.check("ant", (4, 4), small_map.policy_hash)
    with pytest.raises(MapError, match="made for robot 'ant', not for 'walker'"):
        small_map.check("walker", (16, 16), small_map.policy_hash)


def test_own_maps_come_before_shipped_ones(
    tmp_path: Path, map_text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = find_map("ant")
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "ant.toml").write_text(map_text)
    (tmp_path / "maps" / "torn.toml").write_text("schema = ")
    assert find_map("ant") == tmp_path / "maps" / "ant.toml" != shipped
    listed = {entry.path.stem: entry for entry in list_maps()}
    assert listed["ant"].path == tmp_path / "maps" / "ant.toml"
    assert "not a TOML file" in listed["torn"].problem
    with pytest.raises(MapError, match="no map 'walrus'; available: a1, a1-imprints, ant, "):
        find_map("walrus")


def test_a_controller_may_start_from_a_base(map_text: str) -> None:
    text = map_text.replace('mode = "pid"', 'mode = "pid"\nbase = { "0:5" = 0.5, "1:1" = -2.0 }')
    assert parse_map(text, "m").behaviors["hold heading"].base == {"0:5": 0.5, "1:1": -2.0}
    with pytest.raises(MapError, match="'base': expected only with mode"):
        parse_map(map_text.replace('key = "t"', 'key = "t"\nbase = { "0:5" = 0.5 }'), "m")
    with pytest.raises(MapError, match="'base': 'sway': expected layer:index"):
        parse_map(text.replace('"1:1" = -2.0', '"sway" = -2.0'), "m")


def test_mistakes_in_a_table_of_its_own_lines_are_named(map_text: str) -> None:
    lines = '[behaviors.magnitudes]\n"0:1" = 1.0\n"0:2" = "x"\n'
    text = map_text.replace('magnitudes = { "1:2" = -3.0 }\nperiod = 0.5\ntogether = ["push"]\n', lines)
    with pytest.raises(MapError, match="'0:2': expected a finite number, .*found 'x'"):
        parse_map(text, "m")


def test_only_a_map_without_behaviors_may_leave_its_policy_open(small_map: StimulationMap) -> None:
    bare = map_without_behaviors("my robot", 'runs/"best".safetensors')
    assert (bare.robot, bare.policy) == ("my robot", 'runs/"best".safetensors')
    bare.check("my robot", (16, 16), "f" * 64)
    with pytest.raises(MapError, match="made for robot 'my robot'"):
        bare.check("ant", (16, 16), "f" * 64)
    for kept in (replace(bare, policy_hash="0" * 64), replace(small_map, policy_hash="")):
        with pytest.raises(MapError, match="made for a policy with SHA-256"):
            kept.check(kept.robot, (16, 16), "f" * 64)
