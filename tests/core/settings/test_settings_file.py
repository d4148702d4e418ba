"""Settings are read from the user's file, and what is wrong in it is named in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.errors import SettingsError
from pdtui.core.settings.settings_file import parse_settings, read_settings, settings_path
from pdtui.core.settings.user_settings import UserSettings, list_settings


@pytest.fixture
def config(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / "pdtui" / "config.toml"
    path.parent.mkdir()
    return path


def test_without_a_file_there_are_the_defaults(config: Path) -> None:
    assert settings_path() == config
    assert read_settings() == UserSettings()


def test_a_relative_folder_of_configurations_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", "here")
    monkeypatch.setenv("HOME", "/home/someone")
    assert settings_path() == Path("/home/someone/.config/pdtui/config.toml")


def test_a_changed_file_is_read_again(config: Path) -> None:
    config.write_text('theme = "nord"\nfps = 20\n[folders]\nmaps = "~/maps"\n[keys]\npause = "ctrl+t"\n')
    assert read_settings() == UserSettings("nord", 20, maps_folder="~/maps", keymap={"pause": "ctrl+t"})
    config.write_text("fps = 9\n")
    assert read_settings() == UserSettings(fps=9)


def test_keys_are_those_of_the_table_but_for_the_users_own() -> None:
    keys = parse_settings('[keys]\npause = "f2"\nfaster = "f8"\n', "c").keys()
    assert (keys["pause"], keys["faster"], keys["slower"]) == ("f2", "f8", "comma")


def test_two_keys_can_be_swapped() -> None:
    assert parse_settings('[keys]\npause = "n"\nstep = "p"\n', "c").keymap == {"pause": "n", "step": "p"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("fps = ", "c: not TOML"),
        ("fps = 0", "c: fps: expected a whole number from 1 to 60, found 0"),
        ("fps = true", "c: fps: expected a whole number"),
        ('theme = ""', "c: theme: expected a text"),
        ("theme = 3", "c: theme: expected a text"),
        (
            "color = 1",
            "c: color: no such setting; available: theme, fps, folders.sessions, folders.maps, keys",
        ),
        ("[folders]\nweights = 'w'", "c: folders.weights: no such setting"),
        ("folders = 'w'", "c: folders: no such setting"),
        ("keys = 3", "c: keys: expected a table"),
        ("[keys]\nstop = 'x'", "c: keys.stop: no such binding; available: target_up"),
        ("[keys]\npause = 'spacebar'", "c: keys.pause: expected a character"),
        ("[keys]\npause = 3", "c: keys.pause: expected a character"),
        ("[keys]\npause = 'r'", "c: keys: the key r is bound to both reset and pause"),
        ("[keys]\npause = 'ctrl+c'", "c: keys: the key ctrl\\+c is bound to both quitting, always and pause"),
    ],
)
def test_what_is_wrong_is_named(text: str, said: str) -> None:
    with pytest.raises(SettingsError, match=said) as caught:
        parse_settings(text, "c")
    assert "\n" not in str(caught.value)


def test_every_setting_has_a_sentence() -> None:
    assert all(one.says.endswith(".") for one in list_settings())
    assert [one.name for one in list_settings()][:2] == ["theme", "fps"]
