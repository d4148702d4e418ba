"""Keys for proposed behaviors: easy to remember, and none twice."""

from __future__ import annotations

import string

from pdtui.core.key_table import RESERVED_KEYS


class KeyAllocator:
    """Hands out free keys.

    Args:
        taken: keys that other behaviors have.
    """

    def __init__(self, taken: set[str]) -> None:
        self._taken: set[str] = {*taken, *RESERVED_KEYS}

    def take_pair(self, name: str) -> tuple[str, str] | None:
        """Two keys that belong together: a capital, for more of something, and its small letter, for less.

        A letter of the name if one is free, the first of its words before others, else any; None when all are
        taken. A letter that is reserved is free in neither size.
        """
        initials = "".join(word[0] for word in name.split())
        for letter in (initials + name).lower() + string.ascii_lowercase:
            if letter in string.ascii_lowercase and not {letter, letter.upper()} & self._taken:
                self._taken |= {letter, letter.upper()}
                return letter.upper(), letter
        return None
