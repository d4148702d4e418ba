"""Names of files that a map or a session gives: nothing outside of the folders is followed."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.policy_file_lookup import (
    POLICY_FOLDERS_VARIABLE,
    find_file_inside_folders,
    policy_search_folders,
)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory with a folder of maps; weights there and beside it."""
    monkeypatch.delenv(POLICY_FOLDERS_VARIABLE, raising=False)
    work = tmp_path / "work"
    (work / "maps").mkdir(parents=True)
    for path in (tmp_path / "outside.st", work / "own.st", work / "maps" / "beside.st"):
        path.write_bytes(b"x")
    (work / "link.st").symlink_to(tmp_path / "outside.st")
    monkeypatch.chdir(work)
    return work


def test_files_of_the_working_directory_and_the_maps_folder_are_found(here: Path) -> None:
    maps = (Path("maps"),)
    assert find_file_inside_folders("own.st", maps, "m") == Path("own.st")
    assert find_file_inside_folders("beside.st", maps, "m") == Path("maps/beside.st")
    assert find_file_inside_folders("../own.st", maps, "m") == Path("maps/../own.st")
    assert find_file_inside_folders(str(here / "own.st"), maps, "m") == here / "own.st"
    assert find_file_inside_folders("ant", maps, "m") is None


def test_the_map_s_own_folder_comes_first(here: Path) -> None:
    (here / "maps" / "own.st").write_bytes(b"x")
    assert find_file_inside_folders("own.st", (Path("maps"),), "m") == Path("maps/own.st")


def test_a_file_in_a_folder_of_maps_may_name_what_lies_above_it(
    here: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    for name in ("own.st", "../own.st"):
        found = find_file_inside_folders(name, policy_search_folders(here / "maps" / "a.toml"), "m")
        assert found is not None
        assert found.samefile(here / "own.st")
    assert policy_search_folders(here / "own.toml") == (here,)
    with pytest.raises(PolicyError, match="lies outside"):
        find_file_inside_folders("../outside.st", policy_search_folders(here / "own.toml"), "m")
    with pytest.raises(PolicyError, match="lies outside"):
        find_file_inside_folders("../../outside.st", policy_search_folders(here / "maps" / "a.toml"), "m")


@pytest.mark.parametrize(
    "name", ["../outside.st", "{}/outside.st", "link.st", "/dev/zero", "../../../etc/passwd"]
)
def test_what_leads_outside_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(PolicyError, match=r"m\.toml: names the file .* which lies outside"):
        find_file_inside_folders(name.format(tmp_path), (Path("maps"),), "m.toml")


def test_a_folder_can_be_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(POLICY_FOLDERS_VARIABLE, str(tmp_path))
    assert find_file_inside_folders("../outside.st", (), "m") == Path("../outside.st")
    assert find_file_inside_folders("link.st", (), "m") == Path("link.st")


def test_names_that_cannot_be_files_are_none() -> None:
    assert find_file_inside_folders("a" * 5000, (), "m") is None
