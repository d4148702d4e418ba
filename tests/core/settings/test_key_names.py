"""Keys are named as Textual names them."""

from __future__ import annotations

import string

import pytest
from textual.keys import _character_to_key

from pdtui.core.reserved_keys import KEY_TABLE
from pdtui.core.settings.key_names import normalize_key


@pytest.mark.parametrize("character", [*string.printable.strip(), "é", "ö"])
def test_a_character_has_the_name_that_the_screen_gets(character: str) -> None:
    assert normalize_key(character) == _character_to_key(character)


@pytest.mark.parametrize("key", [row.key for row in KEY_TABLE] + ["ctrl+g", "f12", "shift+tab", "ctrl+."])
def test_names_stay_names(key: str) -> None:
    assert normalize_key(key) == key.replace(".", "full_stop")


@pytest.mark.parametrize("key", ["", "ctr+g", "ctrl+", "spacebar", "f99", "a b", "\x07", "ctrl+ctrl+xx"])
def test_what_is_no_key_is_refused(key: str) -> None:
    with pytest.raises(ValueError, match="expected"):
        normalize_key(key)
