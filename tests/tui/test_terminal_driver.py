"""What a terminal sends becomes keys, clicks and pasted text; what means nothing ends nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from textual.events import Key, MouseDown, Paste
from textual.message import Message

from pdtui.tui.terminal_driver import TerminalInputParser


def read(*texts: str) -> list[Message]:
    messages: list[Message] = []
    reader = TerminalInputParser(messages.append)
    for text in texts:
        reader.feed(text)
    return messages


def keys(*texts: str) -> list[str]:
    return [message.key for message in read(*texts) if isinstance(message, Key)]


def test_keys_clicks_and_pasted_text() -> None:
    assert keys("w\x1b[A\x1bOP\x1b[1;5C\x7f ") == ["w", "up", "f1", "ctrl+right", "backspace", "space"]
    (click,) = read("\x1b[<0;3;", "2M")
    assert isinstance(click, MouseDown)
    assert (click.x, click.y) == (2, 1)
    (paste,) = read("\x1b[200~maps/", "ant\x1b[201~")
    assert isinstance(paste, Paste)
    assert paste.text == "maps/ant"


@pytest.mark.parametrize(
    "nonsense",
    [
        "\x1b[55296u",
        "\x1b[99999999u",
        "\x1b[97:65u",
        "\x1b[1;1;57344:55296u",
        "\N{REPLACEMENT CHARACTER}\x80",
    ],
)
def test_codes_that_are_no_keys_leave_those_after_them(nonsense: str) -> None:
    assert keys(nonsense + "w", "t")[-2:] == ["w", "t"]


def test_an_escape_in_pasted_text_presses_no_key() -> None:
    first, second = read("\x1b[200~q\x1b[Aq\x1b[55296u\x03", "q\x1b[201~w")
    assert isinstance(first, Paste)
    assert isinstance(second, Key)
    assert first.text.startswith("q[Aq")
    assert second.key == "w"


@given(st.text(st.sampled_from("\x1b[]<>?;:0123456789uMm~ARw\x80é\ud800\uffff"), max_size=60))
def test_nothing_that_a_terminal_sends_is_an_error(text: str) -> None:
    for key in keys(text + "\x1b[201~\x1b[201~"):
        key.encode()
