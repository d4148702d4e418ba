"""Disturbances of worlds on MuJoCo: other friction, other masses, and pushes."""

from __future__ import annotations

import copy

import mujoco

from pdtui.robots.geometry import rotate_vectors

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)
# Horizontal part of an axis below which it counts as vertical.
_VERTICAL = 1e-6


def scale_model(model: mujoco.MjModel, friction: float, mass: float) -> mujoco.MjModel:
    """Return a copy of a model with other sliding friction of all surfaces, and other masses and inertias.

    MuJoCo takes the greater friction of two surfaces for their contact.
    """
    scaled = copy.copy(model)
    scaled.geom_friction[:, 0] *= friction
    scaled.body_mass[:] *= mass
    scaled.body_inertia[:] *= mass
    mujoco.mj_setConst(scaled, mujoco.MjData(scaled))
    return scaled


def push_root(model: mujoco.MjModel, data: mujoco.MjData, vx: float, vy: float) -> None:
    """Change the horizontal velocity of the trunk, as far as its joints let it, m/s."""
    for address, (x, y) in find_push_directions(model).items():
        data.qvel[address] += x * vx + y * vy


def find_push_directions(model: mujoco.MjModel) -> dict[int, tuple[float, float]]:
    """Return the horizontal directions of the velocities that move the trunk, by their index in ``qvel``."""
    directions: dict[int, tuple[float, float]] = {}
    root = int(model.jnt_bodyid[0]) if model.njnt else -1
    for joint in range(model.njnt):
        address = int(model.jnt_dofadr[joint])
        if model.jnt_bodyid[joint] != root:
            continue
        if model.jnt_type[joint] == _FREE:
            return {address: (1.0, 0.0), address + 1: (0.0, 1.0)}
        if model.jnt_type[joint] == _SLIDE:
            x, y, _ = rotate_vectors(model.body_quat[root], model.jnt_axis[joint]).tolist()
            if abs(x) + abs(y) > _VERTICAL:
                directions[address] = (x, y)
    return directions
