"""Keys for proposed behaviors: easy to remember, and none twice."""

from __future__ import annotations

import string

from pdtui.stimulation.maps import RESERVED_KEYS


class Keys:
    """Hands out free keys.

    Args:
        taken: keys that other behaviors have.
    """

    def __init__(self, taken: set[str]) -> None:
        self._taken: set[str] = {*taken, *RESERVED_KEYS}

    def take(self, name: str) -> str | None:
        """A letter of the name if one is free, else any letter or digit; None when all are taken."""
        allowed = string.ascii_lowercase + string.digits
        for key in name.lower() + allowed:
            if key in allowed and key not in self._taken:
                self._taken.add(key)
                return key
        return None
