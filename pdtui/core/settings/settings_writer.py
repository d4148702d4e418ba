"""Writes one of the user's settings into their file, in which everything else stays as it was."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import SettingsError
from pdtui.core.settings.settings_file import parse_settings, settings_path


def save_setting(name: str, value: Any) -> Path:
    """Write a setting that is in no table into the user's file, and return the file; comments are kept.

    It follows a line that has it commented out, as `pdtui config` prints one.

    Raises:
        SettingsError: The file cannot be read or written, or is not one of settings; then, it stays as it is.
    """
    path = settings_path()
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        text = ""
    except (OSError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path}: cannot be read: {error}") from error
    parse_settings(text, str(path))
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise SettingsError(f"{path}: not TOML: {error}") from error
    hint = re.search(rf"^# ?{name} = .*\n", text, re.MULTILINE)
    if name in document or hint is None:
        document[name] = value
        changed = tomlkit.dumps(document)
    else:
        line = f"{name} = {tomlkit.item(value).as_string()}\n"
        changed = f"{text[: hint.end()]}{line}{text[hint.end() :]}"
    parse_settings(changed, str(path))
    write_file(path, changed, SettingsError)
    return path
