"""What the screen shows at one moment: letters with their colors, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from rich.color import Color
from textual.app import App

_FRONT, _BACK = "#cdd6e0", "#0c1016"


class ScreenCell(NamedTuple):
    """A letter, its color and that of its background, and whether it is bold."""

    letter: str
    front: str
    back: str
    bold: bool


@dataclass(frozen=True)
class CastFrame:
    """What is shown for some time.

    Attributes:
        lines: the cells of each line.
        caption: what is said of it.
        seconds: for how long, s.
    """

    lines: tuple[tuple[ScreenCell, ...], ...]
    caption: str
    seconds: float


def capture_frame(app: App[str], caption: str, seconds: float) -> CastFrame:
    """Return what an application shows now."""
    lines = []
    for strip in app.screen._compositor.render_strips():
        cells: list[ScreenCell] = []
        for text, style, control in strip:
            if control:
                continue
            front, back, bold = _FRONT, _BACK, False
            if style is not None:
                front, back, bold = _name(style.color, _FRONT), _name(style.bgcolor, _BACK), bool(style.bold)
                if style.reverse:
                    front, back = back, front
            cells += [ScreenCell(letter, front, back, bold) for letter in text]
        lines.append(tuple(cells))
    return CastFrame(tuple(lines), caption, seconds)


def _name(color: Color | None, default: str) -> str:
    return default if color is None or color.triplet is None else color.triplet.hex
