"""Colors that can be read on a background, whatever the theme."""

from __future__ import annotations

from textual.color import Color

TEXT_CONTRAST = 4.5
"""Least contrast of text (Web Content Accessibility Guidelines 2.2, criterion 1.4.3)."""
MARK_CONTRAST = 3.0
"""The same of marks, lines and large letters (criterion 1.4.11)."""
_STEPS = 20


def contrast_ratio(one: Color, other: Color) -> float:
    """Return the contrast of two colors, from 1 to 21, as the same guidelines define it."""
    dark, light = sorted((_luminance(one), _luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def make_legible(color: Color, background: Color, contrast: float = TEXT_CONTRAST) -> Color:
    """Return the color, made lighter on a dark background and darker on a light one as far as needed."""
    end = Color(255, 255, 255) if _luminance(background) < 0.18 else Color(0, 0, 0)
    for step in range(_STEPS):
        mended = color.blend(end, step / _STEPS)
        if contrast_ratio(mended, background) >= contrast:
            return mended
    return end


def _luminance(color: Color) -> float:
    red, green, blue = (_linear(part) for part in color.normalized)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _linear(part: float) -> float:
    return part / 12.92 if part <= 0.04045 else float(((part + 0.055) / 1.055) ** 2.4)
