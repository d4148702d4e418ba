"""Where the soles of a robot's feet are, and how fast they slide, from the poses of its bodies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.robots.geometry import capsule_ends, compute_link_poses, rotate_vectors

_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def find_soles(links: Sequence[Link], poses: Floats) -> Floats:
    """Return the lowest point of each link in the world, m, shape (T, F, 3).

    Args:
        links: The F links that stand on the ground.
        poses: Poses of all bodies at each control step, shape (T, B, 7).
    """
    placed = compute_link_poses(links, poses)
    ends = capsule_ends(links, placed)
    soles = np.empty((*placed.shape[:-1], 3))
    for column, link in enumerate(links):
        if link.shape == "box":
            corners = rotate_vectors(placed[:, None, column, 3:], _CORNERS * link.size)
            soles[:, column] = placed[:, column, :3] + _lowest(corners)
        else:
            soles[:, column] = _lowest(ends[:, column]) - (0.0, 0.0, link.size[0])
    return soles


def measure_sole_speeds(links: Sequence[Link], poses: Floats, soles: Floats, dt: float) -> Floats:
    """Return how fast each sole slides along the ground between two control steps, m/s, shape (T − 1, F).

    The point of the foot that is lowest moves over a foot that rolls. Its speed is not that of sliding, so
    this takes the speed of the material: of the mean of two points, of that which is lowest before and of
    that which is lowest after the step.

    Args:
        links: The F links that stand on the ground.
        poses: Poses of all bodies, shape (T, B, 7).
        soles: What `find_soles` returned for them, shape (T, F, 3).
        dt: Duration of a control step, s.
    """
    bodies = poses[:, [link.body for link in links]]
    before, after = bodies[:-1], bodies[1:]
    forth = _carry(soles[:-1], before, after) - soles[:-1]
    back = soles[1:] - _carry(soles[1:], after, before)
    moved = 0.5 * (forth + back)
    speeds: Floats = np.hypot(moved[..., 0], moved[..., 1]) / dt
    return speeds


def _lowest(points: Floats) -> Floats:
    """Return the lowest of the points of each step, shape (T, n, 3), shape (T, 3)."""
    lowest: Floats = points[np.arange(len(points)), points[..., 2].argmin(axis=1)]
    return lowest


def _carry(points: Floats, start: Floats, end: Floats) -> Floats:
    """Return where points of bodies at one pose are at another, shape (..., 3)."""
    local = rotate_vectors(start[..., 3:] * _CONJUGATE, points - start[..., :3])
    return end[..., :3] + rotate_vectors(end[..., 3:], local)
