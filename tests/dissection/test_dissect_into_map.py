"""Dissecting into a map: no roll-out is lost before everything is written."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.cli.dissect_command import dissect_command
from pdtui.core.errors import MapError, PictureError
from pdtui.dissection.dissect_into_map import dissect_into_map, journal_path
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.dissection.dissection_result import Dissection
from pdtui.policies.weights.policy_file_lookup import POLICY_FOLDERS_VARIABLE
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.stimulation.map_reader import load_map
from tests.small_dissection import SMALL


def test_roll_outs_are_kept_until_map_and_pictures_are_written(policy_file: Path, tmp_path: Path) -> None:
    output, journal = tmp_path / "maps" / "small.toml", tmp_path / "maps" / ".small.rollouts"
    assert journal_path(output) == journal

    def block_output(stage: str, _done: int, _total: int) -> None:
        if stage == "up and down":
            output.mkdir(exist_ok=True)

    def fail_to_draw(_: Dissection) -> Sequence[Path]:
        raise PictureError("small.rrd: cannot be written: No space left on device")

    config = DissectionConfig("ant", policy_file, settings=SMALL, episodes=2, workers=1, budget_minutes=0.0)
    with pytest.raises(MapError, match=r"small\.toml: cannot be written: Is a directory"):
        dissect_into_map(replace(config, progress=block_output), output)
    with RolloutJournal(journal, "") as kept:
        rollouts = len(kept)
    assert rollouts > 16 * len(SMALL.screen_values) * SMALL.screen_starts
    output.rmdir()
    with pytest.raises(PictureError, match="No space left"):
        dissect_into_map(config, output, draw=fail_to_draw)
    with RolloutJournal(journal, "") as kept:
        assert len(kept) == rollouts
    with pytest.raises(MapError, match=r"small\.toml: already exists; --overwrite replaces it"):
        dissect_into_map(config, output)
    drawn = tmp_path / "small.rrd"
    written = dissect_into_map(config, output, overwrite=True, draw=lambda _: [drawn])
    assert not journal.exists()
    assert written.as_dict()["pictures"] == [str(drawn)]
    assert tuple(load_map(output).behaviors) == written.behaviors


def test_a_map_finds_its_policy_from_any_folder(
    policy_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(POLICY_FOLDERS_VARIABLE)
    project, elsewhere = tmp_path / "project", tmp_path / "elsewhere"
    (project / "policies").mkdir(parents=True)
    elsewhere.mkdir()
    shutil.copy(policy_file, project / "policies" / "small.safetensors")
    monkeypatch.chdir(project)
    config = DissectionConfig(
        "ant", "policies/small.safetensors", settings=SMALL, episodes=2, workers=1, budget_minutes=0.0
    )
    dissect_into_map(config, Path("maps", "small.toml"))
    assert load_map(Path("maps", "small.toml")).policy == "../policies/small.safetensors"

    def run(*arguments: str) -> str:
        result = CliRunner().invoke(main, arguments)
        assert result.exit_code == 0, result.output
        return result.output

    drive = "--headless", "--steps", "8"
    run("drive", "maps/small.toml", *drive, "--record", "sessions/a.rrd")
    monkeypatch.chdir(elsewhere)
    run("drive", str(project / "maps" / "small.toml"), *drive, "--no-record")
    assert run("replay", "../project/sessions/a.rrd").endswith("identical: 8 steps\n")


def test_the_map_names_the_robots_options(dissection: Dissection) -> None:
    assert dissection.to_map().robot_options == dissection.robot_options == {}
    assert replace(dissection, robot_options={"forward": "x"}).to_map().robot_options == {"forward": "x"}


def test_the_command_has_the_defaults_of_the_python_api() -> None:
    defaults = {field.name: field.default for field in fields(DissectionConfig)}
    options = {option.name: option.default for option in dissect_command.params}
    shared = {name for name in options.keys() & defaults.keys() if isinstance(options[name], str | int)}
    assert {"preset", "episodes", "seed"} <= shared
    for name in shared - {"policy"}:
        assert options[name] == defaults[name]
