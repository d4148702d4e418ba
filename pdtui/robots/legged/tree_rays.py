"""What a camera of one row of pixels sees of upright trunks; no simulator."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Floats


def tree_nearness(place: tuple[float, float], yaw: float, trees: Floats, fan: Floats, reach: float) -> Floats:
    """How near the next trunk is along each ray: 1 at the camera, 0 from `reach` on.

    Args:
        place: x and y of the camera, m.
        yaw: where it looks, rad.
        trees: x, y and radius of each, m, shape (N, 3).
        fan: angles of the rays from there, rad, to the left positive, shape (R,).
        reach: m.

    Returns:
        1 − distance / reach, shape (R,).
    """
    away = trees[:, :2] - np.array(place)
    close = np.hypot(*away.T) - trees[:, 2] < reach
    away, radii = away[close], trees[close, 2]
    rays = np.stack([np.cos(yaw + fan), np.sin(yaw + fan)])
    along = away @ rays  # shape (trees, rays): how far along the ray the trunk is nearest to it
    beside = away[:, [1]] * rays[0] - away[:, [0]] * rays[1]
    half_chord = radii[:, None] ** 2 - beside**2
    hit = (half_chord >= 0.0) & (along > 0.0)
    distance = np.where(hit, along - np.sqrt(np.maximum(half_chord, 0.0)), reach)
    nearest = np.clip(distance.min(axis=0, initial=reach), 0.0, reach)
    seen: Floats = 1.0 - nearest / reach
    return seen
