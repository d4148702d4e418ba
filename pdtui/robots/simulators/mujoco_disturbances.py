"""Disturbances of robots on MuJoCo: other friction, other masses, and pushes."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

from pdtui.core.errors import RobotError
from pdtui.robots.environments.mujoco_gymnasium_robot import MujocoGymnasiumRobot
from pdtui.robots.geometry import rotate_vectors
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.mujoco_robot import MujocoRobot

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)
# Horizontal part of an axis below which it counts as vertical.
_VERTICAL = 1e-6


def offers_scaled_physics(robot: Robot) -> bool:
    """Return whether a robot's friction and masses can be scaled."""
    return _find_world(robot) is not None


@contextmanager
def scaled_physics(robot: Robot, friction: float, mass: float) -> Iterator[None]:
    """Multiply the sliding friction of all surfaces, and all masses and inertias, while the block runs.

    The robot has another model meanwhile, so that its own comes back to the last bit.

    Raises:
        RobotError: The robot is not on MuJoCo.
    """
    world = _require_world(robot)
    own = world.model
    scaled = copy.copy(own)
    scaled.geom_friction[:, 0] *= friction
    scaled.body_mass[:] *= mass
    scaled.body_inertia[:] *= mass
    mujoco.mj_setConst(scaled, mujoco.MjData(scaled))
    world.model = scaled
    try:
        yield
    finally:
        world.model = own


def push_trunk(robot: Robot, vx: float, vy: float) -> None:
    """Change the velocity of a robot's trunk in the world, m/s; one that moves in a plane takes its part.

    The policy has not observed it when it acts next, as with a push that comes from outside.

    Raises:
        RobotError: The robot is not on MuJoCo, or its trunk cannot move horizontally.
    """
    directions = _find_push_directions(robot)
    if not directions:
        raise RobotError(f"{robot.name}: not on MuJoCo, or its trunk cannot move horizontally: no pushes")
    velocities = _require_world(robot).data.qvel
    for address, (x, y) in directions.items():
        velocities[address] += x * vx + y * vy


def offers_pushes(robot: Robot) -> bool:
    """Return whether a robot can be pushed."""
    return bool(_find_push_directions(robot))


def _find_push_directions(robot: Robot) -> dict[int, tuple[float, float]]:
    """Return the horizontal directions of the velocities that move the trunk, by their index in ``qvel``."""
    world = _find_world(robot)
    if world is None or not world.model.njnt:
        return {}
    model, directions = world.model, {}
    root = int(model.jnt_bodyid[0])
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


def _find_world(robot: Robot) -> Any:
    """Return what holds the robot's ``model`` and ``data``, or None for a robot of another simulator."""
    if isinstance(robot, MujocoRobot):
        return robot
    return robot.world if isinstance(robot, MujocoGymnasiumRobot) else None


def _require_world(robot: Robot) -> Any:
    world = _find_world(robot)
    if world is None:
        raise RobotError(f"{robot.name}: expected a robot on MuJoCo, whose friction and masses can be scaled")
    return world
