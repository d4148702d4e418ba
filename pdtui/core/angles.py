"""Angles that jump at ±π."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Floats


def wrap_angle(angle: float) -> float:
    """The same angle in (−π, π], rad."""
    wrapped = (angle + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.pi if wrapped == -np.pi else wrapped)


def wrap_angles(angles: Floats) -> Floats:
    """The same angles in [−π, π), rad, of any shape; NaN stays."""
    wrapped: Floats = np.mod(angles + np.pi, 2.0 * np.pi) - np.pi
    return wrapped
