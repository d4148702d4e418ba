"""Names of keys, as users write them and as terminals' libraries report them."""

from __future__ import annotations

import string
import unicodedata

_SHORTENED = {
    "solidus": "slash",
    "reverse_solidus": "backslash",
    "commercial_at": "at",
    "hyphen_minus": "minus",
    "plus_sign": "plus",
    "low_line": "underscore",
}
_MODIFIERS = ("ctrl", "alt", "shift", "super")
_NAMED = {
    *(
        "space",
        "enter",
        "escape",
        "tab",
        "backspace",
        "delete",
        "insert",
        "home",
        "end",
        "pageup",
        "pagedown",
    ),
    *("up", "down", "left", "right"),
    *(f"f{number}" for number in range(1, 25)),
}


def _name_character(character: str) -> str:
    if character.isalnum():
        return character
    name = unicodedata.name(character, "").lower().replace("-", "_").replace(" ", "_")
    return _SHORTENED.get(name, name)


_PUNCTUATION = {_name_character(character): character for character in string.punctuation + " "}


def normalize_key(key: str) -> str:
    """Return the name of a key that a user has written, such as ``full_stop`` for ``.``, or ``ctrl+g``.

    Raises:
        ValueError: There is no such key.
    """
    *modifiers, name = key.split("+") if len(key) > 1 and not key.endswith("+") else [key]
    if len(name) == 1 and name.isprintable():
        name = _name_character(name)
    elif name not in _NAMED and name not in _PUNCTUATION:
        raise ValueError(f"expected a character, or the name of a key such as ctrl+g or space, found {key!r}")
    if any(modifier not in _MODIFIERS for modifier in modifiers):
        raise ValueError(f"expected modifiers among {', '.join(_MODIFIERS)}, found {key!r}")
    return "+".join([*modifiers, name])
