"""A setting is written into the user's file, and everything else in it stays."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.errors import SettingsError
from pdtui.core.settings.settings_file import read_settings, settings_path
from pdtui.core.settings.settings_text import describe_settings
from pdtui.core.settings.settings_writer import save_setting
from pdtui.core.settings.user_settings import UserSettings


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


@pytest.mark.parametrize(
    "before",
    [
        None,
        "",
        "# mine\n",
        'theme = "gruvbox"  # for the evening\nfps = 20 # fast\n',
        "# mine\nfps = 20 # fast\n\n[keys]\npause = 'f5'  # as elsewhere\n",
        "[folders] # all\nsessions = '/drives'\n",
        describe_settings(UserSettings(fps=20), {}),
    ],
)
def test_what_is_saved_is_read_and_all_else_stays(before: str | None) -> None:
    path = settings_path()
    if before is not None:
        path.parent.mkdir(parents=True)
        path.write_text(before)
    settings = read_settings()
    assert save_setting("theme", "nord") == path
    after = read_settings()
    assert (after.theme, after.fps, after.keymap) == ("nord", settings.fps, settings.keymap)
    assert after.sessions_folder == settings.sessions_folder
    lines = path.read_text().splitlines()
    own = [line for line in (before or "").splitlines() if not line.startswith("theme")]
    assert [line for line in lines if line in own] == own
    assert path.read_text().count('\ntheme = "nord"') + path.read_text().startswith("theme") == 1
    if before is not None and "evening" in before:
        assert "# for the evening" in path.read_text()


def test_a_file_that_is_wrong_stays_as_it_is() -> None:
    path = settings_path()
    path.parent.mkdir(parents=True)
    path.write_text("fps = 'many'\n")
    with pytest.raises(SettingsError, match="fps: expected a whole number"):
        save_setting("theme", "nord")
    assert path.read_text() == "fps = 'many'\n"
