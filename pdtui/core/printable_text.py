"""Text made safe to print: for terminals, and as JSON that has only the numbers that JSON knows."""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

_REPLACED = ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")
"""Unicode categories that a terminal may obey: controls, formatting, surrogates, private use, separators."""


@lru_cache(maxsize=512)
def make_printable(text: str) -> str:
    """Replace tabs and newlines by spaces, and every other character that a terminal would obey by U+FFFD."""
    return text if text.isprintable() else "".join(map(_printable_character, text))


def _printable_character(character: str) -> str:
    if character in "\t\n":
        return " "
    return "\N{REPLACEMENT CHARACTER}" if unicodedata.category(character) in _REPLACED else character


def to_json(data: Any, *, indent: int | None = 2) -> str:
    """Return data as JSON text in which NaN and infinities, which JSON does not know, are ``null``."""
    return json.dumps(_without_nonfinite(data), indent=indent, allow_nan=False)


def _without_nonfinite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _without_nonfinite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_without_nonfinite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
