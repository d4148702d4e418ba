"""Chooses keys for behaviors that a search has found."""

from __future__ import annotations

import string

from pdtui.core.reserved_keys import RESERVED_KEYS


class KeyAllocator:
    """Hands out keys that are neither reserved nor taken by other behaviors."""

    def __init__(self, taken: set[str]) -> None:
        self._taken: set[str] = {*taken, *RESERVED_KEYS}

    def take_key_pair(self, name: str) -> tuple[str, str] | None:
        """Return a capital letter, for more of something, and its small letter, for less, if any is free.

        The first free letter of the first letters of the name's words, of the name, and of the alphabet. If
        either case of a letter is taken or reserved, the letter is not free.
        """
        initials = "".join(word[0] for word in name.split())
        for letter in (initials + name).lower() + string.ascii_lowercase:
            if letter in string.ascii_lowercase and not {letter, letter.upper()} & self._taken:
                self._taken |= {letter, letter.upper()}
                return letter.upper(), letter
        return None
