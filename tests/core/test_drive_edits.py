"""Edits as text and as events."""

from __future__ import annotations

import re

import pytest

from pdtui.core.drive_edits import (
    EDIT_KEY,
    NAMED_EDITS,
    VALUED_EDITS,
    edit_subject,
    is_edit,
    parse_edit,
    write_edit,
)
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError


@pytest.mark.parametrize("kind", [*VALUED_EDITS, *NAMED_EDITS])
@pytest.mark.parametrize("name", ["0:12", "turn left", "gait 2"])
def test_an_edit_is_read_as_it_was_written(kind: str, name: str) -> None:
    value = 0.1 + 0.2 if kind in VALUED_EDITS else 0.0
    text = write_edit(kind, name, value)  # type: ignore[arg-type]
    assert is_edit(text)
    assert parse_edit(text, 7) == DriveEvent(7, kind, name, value, EDIT_KEY)  # type: ignore[arg-type]
    assert edit_subject(text) == (kind, name)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("unit 0:12", "expected 'unit NAME VALUE', found '0:12' as value"),
        ("unit 0:12 nan", "found 'nan' as value"),
        ("unit 0:12 1e999", "found '1e999' as value"),
        ("unit 1.5", "expected the name of what 'unit' changes"),
        ("wave hand", "no edit 'wave'; available: unit, factor"),
        ("free  ", "expected the name of what 'free' changes"),
    ],
)
def test_a_text_that_is_no_edit_is_refused(text: str, message: str) -> None:
    with pytest.raises(KeystrokeError, match=re.escape(message)):
        parse_edit(text, 0)
