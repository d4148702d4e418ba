"""Somebody else's policy through a map: driven, recorded and replayed without its flags."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from click.testing import CliRunner, Result
from torch import nn

from pdtui.cli import main
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.map_policy_lookup import resolve_map_policy
from pdtui.stimulation.map_reader import load_map, parse_map

MAP = """\
schema = 1
robot = "ant"

[policy]
name = "agent.pt"  # beside this map
sha256 = "{sha256}"
{choices}
[[behaviors]]
name = "push"
key = "w"
magnitudes = {{ "0:3" = 4.0 }}
"""
CHOICES = 'activation = "relu"\nsquash = "clip"\nnormalizer = "stats.npz"\n'


def run(*arguments: str | Path | int) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with ``maps/agent.toml``, and weights and statistics beside the map."""
    monkeypatch.chdir(tmp_path)
    maps = tmp_path / "maps"
    maps.mkdir()
    torch.manual_seed(1)
    torch.save(nn.Sequential(nn.Linear(27, 12), nn.ReLU(), nn.Linear(12, 8)).state_dict(), maps / "agent.pt")
    np.savez(maps / "stats.npz", mean=np.full(27, 0.1), var=np.full(27, 0.5))
    import_options = ImportOptions("relu", "none", "stats.npz")
    sha256 = load_policy(maps / "agent.pt", import_options=import_options).sha256
    unclipped = CHOICES.replace("clip", "none")
    (maps / "none.toml").write_text(MAP.format(sha256=sha256, choices=unclipped))
    (maps / "open.toml").write_text(MAP.format(sha256=sha256, choices=""))
    return tmp_path


def test_a_map_carries_the_choices_into_session_and_replay(folder: Path) -> None:
    session = folder / "out.rrd"
    drive = run("drive", "maps/none.toml", "--headless", "--steps", 30, "--record", session)
    assert drive.exit_code == 0, drive.output
    text = read_session(session).info.map_text
    assert "# beside this map" in text
    kept = parse_map(text, "kept")
    assert kept.policy == "maps/agent.pt"
    assert kept.import_options == ImportOptions("relu", "none", "maps/stats.npz")
    (folder / "maps" / "none.toml").unlink()
    assert run("replay", session).stdout == "identical: 30 steps\n"


def test_a_replay_finds_what_has_moved_by_the_policy_option(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("drive", "maps/none.toml", "--headless", "--steps", 20, "--record", "out.rrd")
    (folder / "maps").rename(folder / "elsewhere")
    lost = run("replay", "out.rrd")
    assert lost.exit_code == 1
    assert "pdtui: no policy" in lost.output
    assert run("replay", "out.rrd", "--policy", "elsewhere/agent.pt").stdout == "identical: 20 steps\n"


def test_flags_reach_the_session_and_need_force_where_they_change_the_policy(folder: Path) -> None:
    plain = run("drive", "maps/open.toml", "--headless", "--steps", 5)
    assert "does not say how outputs become actions; choose with --squash none|tanh|clip" in plain.output
    flags = "--activation", "relu", "--squash", "none", "--normalizer", "maps/stats.npz"
    driven = run("drive", "maps/open.toml", *flags, "--headless", "--steps", 20, "--record", "a.rrd")
    assert driven.exit_code == 0, driven.output
    assert run("replay", "a.rrd").stdout == "identical: 20 steps\n"
    other = "drive", "maps/none.toml", "--activation", "tanh", "--headless", "--steps", 20
    assert "made for a policy with SHA-256" in run(*other).output
    forced = run(*other, "--force", "--record", "b.rrd")
    assert forced.exit_code == 0, forced.output
    assert run("replay", "b.rrd").stdout == "identical: 20 steps\n"


def test_evaluate_takes_the_choices_too(folder: Path) -> None:
    result = run("evaluate", "maps/none.toml", "--seeds", "100", "--policy-only", "--json")
    assert result.exit_code == 0, result.output
    refused = run("evaluate", "maps/none.toml", "--squash", "tanh", "--seeds", "100", "--json")
    assert "made for a policy with SHA-256" in refused.output


def test_a_policy_of_other_shapes_is_refused_with_both(folder: Path) -> None:
    torch.save(nn.Sequential(nn.Linear(4, 6), nn.Tanh(), nn.Linear(6, 2)).state_dict(), "small.pt")
    result = run("drive", "maps/none.toml", "--policy", "small.pt", "--normalizer", "none", "--headless")
    assert result.exit_code == 1
    assert "expected observations of shape (27,) and actions of shape (8,), as ant has" in result.output
    assert "the policy has observations of shape (4,) and actions of shape (2,)" in result.output


def test_a_converted_policy_needs_no_choices(folder: Path) -> None:
    flags = "--activation", "relu", "--squash", "clip", "--robot", "ant"
    converted = run("convert", "maps/agent.pt", "-o", "agent.safetensors", *flags)
    assert converted.exit_code == 0, converted.output
    assert "27 observations, hidden 12 relu, 8 actions, head mean" in converted.output
    policy = load_policy("agent.safetensors", "ant")
    assert abs(policy.act(np.full(27, 50.0)).action).max() == 1.0
    again = run("convert", "maps/agent.pt", "-o", "agent.safetensors", *flags)
    assert "agent.safetensors: already exists" in again.output


def test_a_map_that_needs_nothing_stays_as_it_is(folder: Path) -> None:
    shipped = load_map(folder / "maps" / "none.toml")
    settled = resolve_map_policy(shipped)
    assert settled.text != shipped.text
    assert resolve_map_policy(settled) is settled


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("relu", "sine", r"m\.toml:7: policy: field 'activation': expected one of tanh, relu.*found 'sine'"),
        ('"clip"', "1", r"m\.toml:8: policy: field 'squash': expected text, found a number"),
        ("normalizer", "normal", r"m\.toml:9: policy: field 'normal': not a field of this table"),
    ],
)
def test_mistakes_in_the_choices_name_line_and_field(old: str, new: str, message: str) -> None:
    with pytest.raises(MapError, match=message):
        parse_map(MAP.format(sha256="0", choices=CHOICES).replace(old, new), "m.toml")


def test_the_spelling_of_earlier_maps_is_read() -> None:
    text = MAP.format(sha256="0", choices=CHOICES)
    earlier = parse_map(text.replace("normalizer", "normaliser"), "m.toml")
    assert earlier.import_options == parse_map(text, "m.toml").import_options
    assert earlier.import_options.normalizer == "stats.npz"
