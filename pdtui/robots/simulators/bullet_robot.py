"""What PyBullet robots share: a world that every reset builds anew, snapshots of it, and its scenery."""

from __future__ import annotations

import ctypes
import math
import os
import sys
import tempfile
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.legged.terrain import CELL, RoughGround
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.python_state import digest_values

_TREE_HEIGHT = 1.2  # m
# Depth of the plane around rough ground and of the trees' roots, m.
_DEPTH = 0.02


@contextmanager
def _silence() -> Iterator[None]:
    """Keep off the screen what a C library writes past Python's streams."""
    flush = ctypes.CDLL(None).fflush
    flush(None)
    kept = {stream: os.dup(stream) for stream in (1, 2)}
    try:
        with Path(os.devnull).open("w") as nowhere:
            for stream in kept:
                os.dup2(nowhere.fileno(), stream)
        yield
        flush(None)
    finally:
        for stream, before in kept.items():
            os.dup2(before, stream)
            os.close(before)


def bullet_data_folder() -> Path:
    """Return the folder of the models of ``pybullet_data``."""
    import pybullet_data

    return Path(pybullet_data.getDataPath())


class BulletRobot(Robot):
    """A robot in a PyBullet world without a screen.

    A used world does not repeat itself, so every reset builds it from nothing, as a function of the world's
    seed and the start. A snapshot is the file that PyBullet saves. It restores bit for bit into a world that
    was built in the same way, as long as the order of contacts is fixed. PyBullet saves a height field only
    if it is a rigid body (``useMaximalCoordinates``), so it is one.

    Raises:
        RobotError: PyBullet is not installed.
    """

    def __init__(self) -> None:
        try:
            with _silence():  # PyBullet prints its build time and arguments
                from pybullet_utils.bullet_client import BulletClient

                self.bullet: Any = BulletClient()
        except ImportError as error:
            running = f"{sys.version_info.major}.{sys.version_info.minor}"
            raise RobotError(
                f"this robot needs PyBullet, which is not installed in this Python {running} ({error}); it "
                "has wheels for Python 3.11 and older: install pdtui there, or build PyBullet by "
                "'pip install pybullet'"
            ) from error
        self.robot_id = -1
        self._world: tuple[int, str] | None = None
        # Factors on friction and masses: of the next world that is built, and of the present one.
        self._scales = self._built_scales = (1.0, 1.0)

    @abstractmethod
    def build_world(self, seed: int, start: str) -> int:
        """Fill an empty world and return the robot's body number."""

    @abstractmethod
    def simulator_numbers(self) -> tuple[Any, ...]:
        """Return the simulator's positions and velocities as plain numbers."""

    def rebuild_world(self, seed: int, start: str) -> None:
        """Build the world of a seed and a start."""
        self.bullet.resetSimulation()
        # Otherwise the solver meets contacts in the order in which they arose, which no snapshot holds.
        self.bullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1)
        self.robot_id = self.build_world(seed, start)
        if self._scales != (1.0, 1.0):
            scale_bodies(self.bullet, *self._scales)
        self._world, self._built_scales = (seed, start), self._scales

    @property
    def offers_pushes(self) -> bool:
        return True

    def push_trunk(self, vx: float, vy: float) -> None:
        x, y, z = self.bullet.getBaseVelocity(self.robot_id)[0]
        self.bullet.resetBaseVelocity(self.robot_id, linearVelocity=[x + vx, y + vy, z])

    @property
    def offers_scaled_physics(self) -> bool:
        return True

    @contextmanager
    def scaled_physics(self, friction: float, mass: float) -> Iterator[None]:
        before = self._scales
        self._scales = (friction, mass)
        try:
            yield
        finally:
            self._scales = before

    def snapshot(self) -> RobotState:
        if self._world is None:
            raise RobotError(f"{self.name}: expected a reset before a snapshot, found none")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "world.bullet"
            self.bullet.saveBullet(str(path))
            saved = path.read_bytes()
        seed, start = self._world
        mark = np.array([len(saved), seed, self.starts.index(start)], np.float64)
        state = np.frombuffer(saved + bytes(-len(saved) % 8)).copy()
        extras = (mark, *self._copy_arrays())
        return RobotState(self.name, state, extras, self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self._check_snapshot(snapshot)
        length, seed, start = (int(value) for value in snapshot.extras[0])
        if not 0 <= length <= snapshot.state.nbytes < length + 8:
            raise RobotError(f"{self.name}: expected a state of {length} bytes, got {snapshot.state.nbytes}")
        if (self._world, self._built_scales) != ((seed, self.starts[start]), self._scales):
            self.rebuild_world(seed, self.starts[start])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "world.bullet"
            path.write_bytes(snapshot.state.tobytes()[:length])
            # Contacts are restored only where the bodies touch already, which the first call brings about.
            self.bullet.restoreState(fileName=str(path))
            self.bullet.performCollisionDetection()
            self.bullet.restoreState(fileName=str(path))
        self._restore_arrays(snapshot.extras[1:])
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return digest_values(self._world, self.simulator_numbers(), list(self._copy_arrays()))

    def close(self) -> None:
        if self.bullet is not None:
            self.bullet.disconnect()
            self.bullet = None


def scale_bodies(bullet: Any, friction: float, mass: float) -> None:
    """Multiply the friction of every contact, and all masses and inertias, of what is in the world.

    Bullet multiplies the frictions of two surfaces, so each gets the root of the factor. Rolling and spinning
    friction are scaled, too.
    """
    root = math.sqrt(friction)
    for body in map(bullet.getBodyUniqueId, range(bullet.getNumBodies())):
        for link in range(-1, bullet.getNumJoints(body)):
            now = bullet.getDynamicsInfo(body, link)
            changed = {"lateralFriction": now[1], "rollingFriction": now[6], "spinningFriction": now[7]}
            changed = {name: root * value for name, value in changed.items()}
            if now[0] > 0.0 and mass != 1.0:  # what stands still has no mass
                inertia = [mass * value for value in now[2]]
                bullet.changeDynamics(body, link, mass=mass * now[0], localInertiaDiagonal=inertia)
            bullet.changeDynamics(body, link, **changed)


def add_ground_plane(bullet: Any, friction: dict[str, float], level: float = 0.0) -> None:
    """Add an endless plane at a level, m."""
    shape = bullet.createCollisionShape(bullet.GEOM_PLANE)
    plane = bullet.createMultiBody(0, shape, basePosition=[0, 0, level])
    bullet.changeDynamics(plane, -1, **friction)


def add_rough_ground(bullet: Any, ground: RoughGround, friction: dict[str, float]) -> None:
    """Add uneven ground and a plane around it."""
    add_ground_plane(bullet, friction, -_DEPTH)
    rows, columns = ground.heights.shape
    shape = bullet.createCollisionShape(
        bullet.GEOM_HEIGHTFIELD,
        meshScale=[CELL, CELL, 1.0],
        heightfieldData=ground.heights.T.ravel().tolist(),  # x varies fastest
        numHeightfieldRows=rows,
        numHeightfieldColumns=columns,
    )
    # Bullet puts the middle of the grid's bounding box at the body's origin.
    x, y = (at + CELL * (n - 1) / 2 for at, n in zip(ground.corner, ground.heights.shape, strict=True))
    middle = float(ground.heights.min() + ground.heights.max()) / 2
    body = bullet.createMultiBody(0, shape, basePosition=[x, y, middle], useMaximalCoordinates=True)
    bullet.changeDynamics(body, -1, **friction)


def add_trees(bullet: Any, trees: Floats) -> list[int]:
    """Add upright cylinders and return their body numbers."""
    bodies = []
    for x, y, radius in trees.tolist():
        shape = bullet.createCollisionShape(bullet.GEOM_CYLINDER, radius=radius, height=_TREE_HEIGHT)
        place = [x, y, _TREE_HEIGHT / 2 - _DEPTH]
        bodies.append(bullet.createMultiBody(0, shape, basePosition=place, useMaximalCoordinates=True))
    return bodies
