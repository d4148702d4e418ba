"""Rotations and poses, vectorized over leading axes. Quaternions are w x y z, of unit length."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pdtui.core.attributes import Floats
    from pdtui.core.robot_links_and_state import Link


def multiply_quaternions(a: Floats, b: Floats) -> Floats:
    """Return the Hamilton product, shape (..., 4): the rotation b followed by a."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    return np.stack([w, x, y, z], axis=-1)


def rotate_vectors(quaternion: Floats, vector: Floats) -> Floats:
    """Rotate vectors (..., 3) by quaternions (..., 4): v + w t + u × t with t = 2 u × v, u = (x, y, z)."""
    w, ux, uy, uz = (quaternion[..., part] for part in range(4))
    vx, vy, vz = (vector[..., part] for part in range(3))
    # numpy.cross takes twice as long for few vectors and for many; numpy.moveaxis half as long again for few.
    tx, ty, tz = 2.0 * (uy * vz - uz * vy), 2.0 * (uz * vx - ux * vz), 2.0 * (ux * vy - uy * vx)
    rotated = np.empty((*tx.shape, 3))
    rotated[..., 0] = vx + w * tx + (uy * tz - uz * ty)
    rotated[..., 1] = vy + w * ty + (uz * tx - ux * tz)
    rotated[..., 2] = vz + w * tz + (ux * ty - uy * tx)
    return rotated


def roll_pitch_yaw(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return the intrinsic z-y'-x'' Euler angles of one quaternion, rad."""
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(1.0, max(-1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def root_body_row(links: Sequence[Link]) -> int:
    """Return the row of the poses that stands for the robot's position: the body of its first shape."""
    return links[0].body if links else 0


def compute_link_poses(links: Sequence[Link], poses: Floats) -> Floats:
    """Return the world poses of links, shape (..., L, 7), from body poses, shape (..., B, 7)."""
    bodies = poses[..., [link.body for link in links], :]
    offsets = np.array([link.position for link in links], dtype=np.float64)
    turns = np.array([link.quaternion for link in links], dtype=np.float64)
    position = bodies[..., :3] + rotate_vectors(bodies[..., 3:], offsets)
    return np.concatenate([position, multiply_quaternions(bodies[..., 3:], turns)], axis=-1)


def capsule_ends(links: Sequence[Link], placed: Floats) -> Floats:
    """Return both ends of each link's axis, shape (..., L, 2, 3); those of a sphere coincide.

    Args:
        links: The shapes; a box counts as a segment along its longest side.
        placed: Their world poses from `compute_link_poses`, shape (..., L, 7).
    """
    axes = np.zeros((len(links), 3))
    for row, link in enumerate(links):
        if link.shape == "capsule":
            axes[row, 2] = link.size[1]
        elif link.shape == "box":
            axes[row, int(np.argmax(link.size))] = max(link.size)
    half = rotate_vectors(placed[..., 3:], axes)
    return np.stack([placed[..., :3] - half, placed[..., :3] + half], axis=-2)
