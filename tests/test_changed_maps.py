"""Commands that change a map leave those that come with pdtui as they are, and write a copy."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pdtui.cli import main
from pdtui.stimulation import map_library
from pdtui.stimulation.map_library import find_map, shipped_folder, user_map_path
from pdtui.stimulation.map_reader import load_map
from tests.small_map import write_small_map


def run(*arguments: str | Path | int) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the maps of an installed pdtui; the working directory is another one."""
    folder = tmp_path / "installed" / "maps"
    folder.mkdir(parents=True)
    monkeypatch.setattr(map_library, "shipped_folder", lambda _: folder)
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return folder


def test_evaluate_writes_the_effects_into_a_copy(shipped: Path) -> None:
    path = write_small_map(shipped)
    before = path.read_text()
    quick = ("--seeds", "100-101", "--quick", "--hold", 100, "--update")
    done = run("evaluate", "ant", "--map", "small", *quick)
    assert done.exit_code == 0, done.output
    told = (
        f"maps/small.toml: wrote the effects; it is a copy, since {path} comes with pdtui and is not changed"
    )
    assert told in done.stderr
    assert path.read_text() == before
    assert load_map(Path("maps/small.toml")).behaviors["push"].measured is not None
    assert find_map("small") == Path.cwd() / "maps" / "small.toml"
    refused = run("evaluate", "ant", "--map", path, *quick)
    assert refused.exit_code == 1
    assert (
        "comes with pdtui and is not changed, and a copy, maps/small.toml, already exists" in refused.output
    )
    assert "control steps" not in refused.output


def test_tune_writes_the_gains_into_a_copy(shipped: Path) -> None:
    path = shipped / "ant.toml"
    text = Path(__file__).parents[1].joinpath("maps", "ant.toml").read_text()
    path.write_text(re.sub(r"kp = [-.\d]+, ki = [-.\d]+, kd = [-.\d]+", "kp = 0.0, ki = 0.0, kd = 0.0", text))
    before = path.read_text()
    assert before != text
    few = ("--seeds", "2000-2001", "--points", 2, "--refinements", 0, "--workers", 1)
    unchanged = run("tune", "ant", "hold heading", *few, "--dry-run")
    assert unchanged.exit_code == 0, unchanged.output
    assert not Path("maps").exists()
    done = run("tune", "ant", "hold heading", *few)
    assert done.exit_code == 0, done.output
    assert "maps/ant.toml: wrote the gains of hold heading; it is a copy, since" in done.stdout
    assert path.read_text() == before
    pid = load_map(Path("maps/ant.toml")).behaviors["hold heading"].pid
    assert pid is not None
    assert pid.kp > 0


def test_in_a_checkout_its_own_maps_are_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    path = find_map("ant")
    monkeypatch.chdir(shipped_folder("maps").parent)
    assert user_map_path(path) == path
