"""Reads the user's settings from ``pdtui/config.toml`` in the user's folder of configurations.

That folder is ``$XDG_CONFIG_HOME``, or ``~/.config`` by default (XDG Base Directory Specification 0.8).
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from pdtui.core.errors import SettingsError
from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.core.settings.key_names import normalize_key
from pdtui.core.settings.user_settings import Setting, UserSettings, list_settings
from pdtui.core.untrusted_file import KIB, read_bounded_file

_MOST_BYTES = 64 * KIB
_KEYS = "keys"
ALWAYS_QUITS = "ctrl+c"
"""The key that quits whatever the user's settings say."""
_IDS = {row.id: row for row in KEY_TABLE}


def settings_path() -> Path:
    """Return where the file of the user's settings is, or would be."""
    folder = os.environ.get("XDG_CONFIG_HOME", "")
    # The specification says to ignore a relative path.
    root = Path(folder) if Path(folder).is_absolute() else Path.home() / ".config"
    return root / "pdtui" / "config.toml"


def read_settings() -> UserSettings:
    """Return the user's settings; without a file, the defaults.

    Raises:
        SettingsError: The file cannot be read, or a setting in it does not exist or cannot have its value.
    """
    path = settings_path()
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return UserSettings()
    except OSError as error:
        raise SettingsError(f"{path}: {error.strerror}") from error
    return _read_file(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=1)
def _read_file(path: Path, _changed: int, _size: int) -> UserSettings:
    try:
        text = read_bounded_file(path, _MOST_BYTES).decode()
    except OSError as error:
        raise SettingsError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SettingsError(f"{path}: not UTF-8 text") from error
    return parse_settings(text, str(path))


def parse_settings(text: str, source: str) -> UserSettings:
    """Return the settings that a text gives; a `SettingsError` names the source and the field at fault."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SettingsError(f"{source}: not TOML: {error}") from error
    keymap = _read_keymap(data.pop(_KEYS, {}), source)
    given = dict(_flatten(data))
    known = {one.name: one for one in list_settings()}
    for name in given:
        if name not in known:
            raise SettingsError(f"{source}: {name}: no such setting; available: {_join([*known, _KEYS])}")
    values = {known[name].attribute: _check(known[name], value, source) for name, value in given.items()}
    return UserSettings(**values, keymap=keymap)


def _flatten(data: Mapping[str, Any], above: str = "") -> Iterable[tuple[str, Any]]:
    for name, value in data.items():
        if isinstance(value, dict) and not above:
            yield from _flatten(value, f"{name}.")
        else:
            yield above + name, value


def _check(setting: Setting, value: Any, source: str) -> Any:
    where = f"{source}: {setting.name}"
    if setting.bounds is not None:
        least, most = setting.bounds
        if type(value) is not int or not least <= value <= most:
            raise SettingsError(f"{where}: expected a whole number from {least} to {most}, found {value!r}")
    elif not isinstance(value, str) or not value or not value.isprintable():
        raise SettingsError(f"{where}: expected a text that is not empty, found {value!r}")
    return value


def _read_keymap(data: Any, source: str) -> dict[str, str]:
    """Return keys by the ids of their bindings; no two may have the same key."""
    if not isinstance(data, dict):
        raise SettingsError(f"{source}: {_KEYS}: expected a table of keys by the names of what they do")
    keys: dict[str, str] = {}
    for name, key in data.items():
        if name not in _IDS:
            raise SettingsError(f"{source}: {_KEYS}.{name}: no such binding; available: {_join(_IDS)}")
        try:
            keys[name] = normalize_key(str(key) if isinstance(key, str) else "")
        except ValueError as problem:
            raise SettingsError(f"{source}: {_KEYS}.{name}: {problem}") from problem
    owners = {ALWAYS_QUITS: "quitting, always"}
    for name, row in _IDS.items():
        key = keys.get(name, row.key)
        if key in owners:
            raise SettingsError(f"{source}: {_KEYS}: the key {key} is bound to both {owners[key]} and {name}")
        owners[key] = name
    return {name: key for name, key in keys.items() if key != _IDS[name].key}


def _join(names: Iterable[str]) -> str:
    return ", ".join(names)


def own_folder(kind: Literal["maps", "sessions"]) -> Path:
    """Return the user's own folder of maps or sessions; a relative one is in the working directory."""
    settings = read_settings()
    return Path(settings.maps_folder if kind == "maps" else settings.sessions_folder).expanduser()
