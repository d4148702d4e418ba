"""Finds out whether the terminal can show pictures, by sixels or by kitty's graphics protocol.

This takes textual-image, which comes with ``pip install 'pdtui[graphics]'``.
"""

from __future__ import annotations

from typing import NamedTuple

from textual import constants
from textual.widget import Widget

MOST_PICTURES = {"sixel": 4.0, "kitty": 8.0}
"""Pictures per second: one takes about 80 ms of a core as sixels, and 30 ms by kitty's protocol."""


class TerminalGraphics(NamedTuple):
    """How the terminal shows pictures.

    Attributes:
        protocol: ``sixel`` or ``kitty``.
        widget: class of the widget of textual-image, whose attribute ``image`` is a Pillow image.
    """

    protocol: str
    widget: type[Widget]


def find_terminal_graphics() -> TerminalGraphics | None:
    """Ask the terminal; return None where it can show none, for a browser, and without textual-image.

    Call it before the application runs, which would take the terminal's answer for keys.
    """
    if constants.DRIVER:
        return None
    try:
        from textual_image import renderable, widget  # which asks when it is imported
    except ImportError:
        return None
    if renderable.Image is renderable.SixelImage:
        return TerminalGraphics("sixel", widget.SixelImage)
    if renderable.Image is renderable.TGPImage:
        return TerminalGraphics("kitty", widget.TGPImage)
    return None
