"""The user's settings: each is declared once, with its default and what it does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

from pdtui.core.reserved_keys import KEY_TABLE

MOST_FPS = 60


class Setting(NamedTuple):
    """One setting.

    Attributes:
        name: its name in the file, with the name of its table in front if it is in one.
        attribute: the attribute of `UserSettings` that has its value.
        default: its default.
        says: what it does, in one sentence.
        bounds: the least and the largest value of a number; None for a text.
    """

    name: str
    attribute: str
    default: Any
    says: str
    bounds: tuple[int, int] | None = None


def _setting(name: str, default: Any, says: str, bounds: tuple[int, int] | None = None) -> Any:
    return field(default=default, metadata={"name": name, "says": says, "bounds": bounds})


@dataclass(frozen=True)
class UserSettings:
    """What users can set once for all commands; an option on the command line overrides it.

    `keymap` has the user's keys by the ids of their bindings, for those that differ from `KEY_TABLE`.
    """

    theme: str = _setting("theme", "pdtui", "Theme of the screen.")
    fps: int = _setting("fps", 12, "Number of frames per second on the screen.", (1, MOST_FPS))
    sessions_folder: str = _setting(
        "folders.sessions",
        "sessions",
        "Folder into which drives are recorded, and whose sessions are listed.",
    )
    maps_folder: str = _setting(
        "folders.maps",
        "maps",
        "Folder in which maps are looked up first, and into which new ones are written.",
    )
    keymap: Mapping[str, str] = field(default_factory=dict)

    def keys(self) -> dict[str, str]:
        """Return the key of every row of the key table, by its id."""
        return {row.id: self.keymap.get(row.id, row.key) for row in KEY_TABLE}


def list_settings() -> Iterator[Setting]:
    """Yield all settings except keys, which `KEY_TABLE` lists."""
    for one in fields(UserSettings):
        if "name" in one.metadata:
            yield Setting(
                one.metadata["name"], one.name, one.default, one.metadata["says"], one.metadata["bounds"]
            )
