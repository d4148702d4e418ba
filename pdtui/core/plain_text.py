"""Text for people, on the screen and off it: foreign text made harmless, sizes in words."""

from __future__ import annotations

import unicodedata
from functools import lru_cache


@lru_cache(maxsize=512)
def make_printable(text: str) -> str:
    """Text from a file without anything that a terminal would obey: control and formatting characters."""
    if text.isprintable():
        return text
    return "".join(
        " " if character in "\t\n" else "\N{REPLACEMENT CHARACTER}" if _obeyed(character) else character
        for character in text
    )


def _obeyed(character: str) -> bool:
    return unicodedata.category(character) in ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")


def file_size(count: int) -> str:
    """A file's size in words."""
    if count < 1000:
        return f"{count} B"
    for unit in ("kB", "MB", "GB"):
        if count < 999_950 or unit == "GB":
            return f"{count / 1000:.1f} {unit}"
        count //= 1000
    raise AssertionError("the largest unit takes any size")
