"""What a terminal may send, drawn at random: keys, clicks, scrolls, pasted text and garbage.

Nothing drawn here quits the drive or branches off it, which would drive everything again: neither q nor
ctrl+c nor ctrl+n is among it, except in pasted text.
"""

from __future__ import annotations

import random
from collections.abc import Sequence

DRIVING = (
    *(b"w", b"t", b"h", b" ", b"w", b"t", b"h", b" "),  # the map's own
    *(b"\x1b[A", b"\x1b[B", b"\x1b[C", b"\x1b[D", b"+", b"-", b"r", b"\x7f"),
    *(b"p", b"p", b"n", b",", b".", b"v", b"?", b"?", b"z", b"\t"),
    *(b"<", b"\x1b[F", b"\x1b[F"),  # into the past, and back
    *(b"\x1b", b"\x1b"),  # out of a page that takes the keys, to the drive
)
_CONTROL = [bytes([code]) for code in range(0x20) if code not in (0x03, 0x0E, 0x1B)]
_FUNCTION = [b"\x1bO" + bytes([code]) for code in b"PQRSABCDFH"] + [
    b"\x1b[%d%s~" % (code, modifier) for code in range(1, 35) for modifier in (b"", b";2", b";5", b";3")
]
_ARROWS = [b"\x1b[1;%d%s" % (modifier, bytes([end])) for modifier in range(2, 9) for end in b"ABCDFHPQRS"]
_OTHER = [b"\x1b", b"\x1b\x1b", b"\r", b"\x1b[Z", b"\x1b[I", b"\x1b[O", b"\x1b[E"]
_LETTERS = [bytes([code]) for code in range(0x21, 0x7F) if code != ord("q")]
_UNICODE = [
    text.encode() for text in ("é", "ß", "速", "🤖", "\u200d", "\u202e", "e\u0301", "\ue000", "\uffff")
]
KEYS = (*_CONTROL, *_FUNCTION, *_ARROWS, *_OTHER, *_LETTERS, *_UNICODE, *(b"\x1b" + key for key in _LETTERS))
"""Every kind of key that a terminal sends, with its modifiers."""

_NUMBERS = (
    b"",
    b"0",
    b"1",
    b"27",
    b"65",
    b"97",
    b"97:65",
    b":",
    b"200",
    b"1000",
    b"55296",
    b"57399",
    b"99999999",
)
"""Codes of the Kitty protocol and others: letters, surrogates, and numbers that are no characters."""


def draw_input(drawn: random.Random) -> bytes:
    """Return the bytes of one key, click, scroll, paste or piece of garbage; most drive the robot."""
    kind = drawn.random()
    if kind < 0.60:
        return drawn.choice(DRIVING)
    if kind < 0.75:
        return drawn.choice(KEYS)
    if kind < 0.93:
        return draw_mouse(drawn)
    if kind < 0.95:
        return draw_paste(drawn)
    return draw_garbage(drawn)


def draw_mouse(drawn: random.Random) -> bytes:
    """Return a click, a drag, a move or a turn of the wheel, possibly outside of the screen."""
    column, row = (drawn.choice((drawn.randint(1, 80), drawn.randint(1, 500))) for _ in range(2))
    modifiers = drawn.choice((0, 0, 0, 4, 8, 16))

    def report(button: int, end: str = "M") -> bytes:
        return f"\x1b[<{button + modifiers};{column};{row}{end}".encode()

    match drawn.choice(("click", "click", "double", "drag", "move", "wheel", "wheel", "oldest")):
        case "click":
            button = drawn.randint(0, 2)
            return report(button) + report(button, "m")
        case "double":
            return (report(0) + report(0, "m")) * 2
        case "drag":
            return report(0) + report(32) + f"\x1b[<32;{column + 9};{row + 3}M".encode() + report(0, "m")
        case "move":
            return report(35)
        case "wheel":
            return report(drawn.randint(64, 67)) * drawn.randint(1, 5)
        case _:  # X10's form, whose coordinates are bytes that need not be UTF-8
            return b"\x1b[M" + bytes(drawn.choice((0x20, 0x30, 0x60, 0x80, 0xC3, 0xFF)) for _ in range(3))


def draw_paste(drawn: random.Random) -> bytes:
    """Return text pasted between brackets, with everything in it that would be a key outside of them."""
    text = "q\x03\r\n\tw\x1b[Aé速" * drawn.choice((0, 1, 30, 1000))
    return b"\x1b[200~" + text.encode() + b"\x1b[201~"


def draw_garbage(drawn: random.Random) -> bytes:
    """Return a meaningless escape sequence, a code that is no character, or bytes that are not UTF-8."""

    def some(choices: Sequence[bytes], most: int) -> bytes:
        return b"".join(drawn.choices(choices, k=drawn.randint(1, most)))

    match drawn.randrange(4):
        case 0:
            return b"\x1b[" + b";".join(drawn.choices(_NUMBERS, k=drawn.randint(1, 4))) + drawn.choice(_ENDS)
        case 1:
            return bytes(drawn.choice((0x80, 0xBF, 0xC3, 0xE9, 0xF0, 0xFE, 0xFF)) for _ in range(9))
        case 2:
            return b"\x1b" + drawn.choice((b"]", b"P", b"_", b"^", b"X")) + some(_LETTERS, 40) + b"\x1b\\"
        case _:
            return some([*_CONTROL, *_LETTERS, b"\x1b[", b"\x1b"], 12)


_ENDS = (b"u", b"~", b"R", b"A", b"P", b"m", b"M", b"c", b"n", b"$y", b"x")
