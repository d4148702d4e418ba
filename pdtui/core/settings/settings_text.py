"""The text of `pdtui config`: every setting with what it does, as a file that can be edited and kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit

from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.core.settings.user_settings import Setting, UserSettings, list_settings


def describe_settings(settings: UserSettings, choices: Mapping[str, Sequence[str]]) -> str:
    """Return a settings file, in which what has its default is commented out.

    Args:
        settings: the settings.
        choices: what settings may be, by name, where that is one of several words.
    """
    lines: list[str] = []
    table = ""
    for one in list_settings():
        above, _, name = one.name.rpartition(".")
        if above != table:
            lines += [f"[{above}]"]
            table = above
        lines += [f"# {_explain(one, choices.get(one.name, ()))}"]
        lines += [_assign(name, getattr(settings, one.attribute), one.default), ""]
    lines += ["[keys]"]
    width = max(len(row.id) for row in KEY_TABLE)
    keys = settings.keys()
    for row in KEY_TABLE:
        lines.append(f"{_assign(row.id, keys[row.id], row.key):{width + 28}} # {row.says}")
    return "\n".join(lines) + "\n"


def _explain(setting: Setting, choices: Sequence[str]) -> str:
    allowed = ""
    if setting.bounds is not None:
        allowed = f" From {setting.bounds[0]} to {setting.bounds[1]}."
    elif choices:
        allowed = f" One of {', '.join(choices)}."
    return f"{setting.says}{allowed} Default: {tomlkit.item(setting.default).as_string()}."


def _assign(name: str, value: Any, default: Any) -> str:
    return f"{'# ' if value == default else ''}{name} = {tomlkit.item(value).as_string()}"
