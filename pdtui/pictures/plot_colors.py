"""Colors that people with any color vision can tell apart (Okabe and Ito, 2008)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats

RgbColor = tuple[int, int, int]

ORANGE: RgbColor = (230, 159, 0)
SKY: RgbColor = (86, 180, 233)
GREEN: RgbColor = (0, 158, 115)
BLUE: RgbColor = (0, 114, 178)
VERMILLION: RgbColor = (213, 94, 0)
PURPLE: RgbColor = (204, 121, 167)
GRAY: RgbColor = (150, 150, 150)

CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)


def color_to_hex(color: RgbColor) -> str:
    """Return the color as ``#rrggbb``."""
    return "#" + bytes(color).hex()


def diverging_colors(values: Floats, limit: float) -> NDArray[np.uint8]:
    """Color values: vermillion below zero, white at zero, blue above, gray where there is no number.

    From a magnitude of `limit` on the colors no longer change. Values have any shape (...); the red, green
    and blue of the colors have the shape (..., 3).
    """
    part = np.clip(np.nan_to_num(values) / limit, -1.0, 1.0)[..., None]
    ends = np.where(part < 0, np.array(VERMILLION), np.array(BLUE))
    colors = np.rint(255 + np.abs(part) * (ends - 255.0)).astype(np.uint8)
    return np.asarray(np.where(np.isfinite(values)[..., None], colors, np.uint8(GRAY[0])))
