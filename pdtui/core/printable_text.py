"""Text from files made safe to print on a terminal."""

from __future__ import annotations

import unicodedata
from functools import lru_cache

_REPLACED = ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")
"""Unicode categories that a terminal may obey: controls, formatting, surrogates, private use, separators."""


@lru_cache(maxsize=512)
def make_printable(text: str) -> str:
    """Replace tabs and newlines by spaces, and every other character that a terminal would obey by U+FFFD."""
    if text.isprintable():
        return text
    return "".join(
        " "
        if character in "\t\n"
        else "\N{REPLACEMENT CHARACTER}"
        if unicodedata.category(character) in _REPLACED
        else character
        for character in text
    )
