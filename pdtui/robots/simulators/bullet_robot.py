"""What PyBullet robots share: a world of their own, built anew at every reset, and snapshots of it."""

from __future__ import annotations

import ctypes
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
from pdtui.core.robot_data import RobotState
from pdtui.robots.legged.terrain import CELL, RoughGround
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.python_state import digest_of

_TREE_HEIGHT = 1.2
_BELOW = 0.02


@contextmanager
def _silence() -> Iterator[None]:
    """Keep what a library writes in C, past Python's streams, off the screen."""
    flush = ctypes.CDLL(None).fflush
    flush(None)
    kept, nowhere = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
        flush(None)
    finally:
        for stream, before in zip((1, 2), kept, strict=True):
            os.dup2(before, stream)
            os.close(before)
        os.close(nowhere)


def _new_client() -> Any:
    try:
        with _silence():  # it prints when it was built, and its arguments
            from pybullet_utils.bullet_client import BulletClient

            return BulletClient()
    except ImportError as error:
        running = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise RobotError(
            f"this robot needs PyBullet, which is not installed in this Python {running} ({error}); it has "
            "wheels for Python 3.11 and older: install pdtui there, or build it with 'pip install pybullet'"
        ) from error


def data_folder() -> Path:
    """Where the models of ``pybullet_data`` are."""
    import pybullet_data

    return Path(pybullet_data.getDataPath())


class BulletRobot(Robot):
    """A robot in a PyBullet world without a screen.

    A world that is used again does not repeat itself, so that every reset builds it from nothing: it is a
    function of the world's seed and of the start. A snapshot is the file that PyBullet saves. It restores bit
    for bit into a world that was built alike, as long as the order of contacts is not left to chance. Ground
    of heights is saved only where it is a rigid body (PyBullet's ``useMaximalCoordinates``), so it is one.

    Raises:
        RobotError: PyBullet is not installed.
    """

    def __init__(self) -> None:
        self.bullet = _new_client()
        self.robot_id = -1
        self._world: tuple[int, str] | None = None

    @abstractmethod
    def build_world(self, seed: int, start: str) -> int:
        """Fill an empty world; returns the robot's number."""

    @abstractmethod
    def memory(self) -> tuple[Floats, ...]:
        """What the Python side remembers."""

    @abstractmethod
    def recall(self, memory: tuple[Floats, ...]) -> None:
        """Take back copies of what `memory` gave."""

    @abstractmethod
    def simulator_numbers(self) -> tuple[Any, ...]:
        """The simulator's positions and velocities, plain numbers."""

    def renew(self, seed: int, start: str) -> None:
        """Build the world of a seed and a start."""
        self.bullet.resetSimulation()
        # Else the solver meets contacts in the order in which they came about, which no snapshot has.
        self.bullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1)
        self.robot_id = self.build_world(seed, start)
        self._world = (seed, start)

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
        extras = tuple(array.copy() for array in self.memory())
        return RobotState(self.name, state, (mark, *extras), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        if snapshot.robot != self.name:
            raise RobotError(f"{self.name}: expected a snapshot of {self.name}, got one of {snapshot.robot}")
        length, seed, start = (int(value) for value in snapshot.extras[0])
        if not 0 <= length <= snapshot.state.nbytes < length + 8:
            raise RobotError(f"{self.name}: expected a state of {length} bytes, got {snapshot.state.nbytes}")
        if self._world != (seed, self.starts[start]):
            self.renew(seed, self.starts[start])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "world.bullet"
            path.write_bytes(snapshot.state.tobytes()[:length])
            # Contacts are restored only where the bodies touch already, which the first time brings about.
            self.bullet.restoreState(fileName=str(path))
            self.bullet.performCollisionDetection()
            self.bullet.restoreState(fileName=str(path))
        self.recall(tuple(array.copy() for array in snapshot.extras[1:]))
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return digest_of(self._world, self.simulator_numbers(), list(self.memory()))

    def close(self) -> None:
        if self.bullet is not None:
            self.bullet.disconnect()
            self.bullet = None


def add_plane(bullet: Any, friction: dict[str, float], level: float = 0.0) -> None:
    """An endless plane."""
    plane = bullet.createMultiBody(
        0, bullet.createCollisionShape(bullet.GEOM_PLANE), basePosition=[0, 0, level]
    )
    bullet.changeDynamics(plane, -1, **friction)


def add_ground(bullet: Any, ground: RoughGround, friction: dict[str, float]) -> None:
    """Uneven ground, and a plane around it."""
    add_plane(bullet, friction, -_BELOW)
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
    """Upright cylinders; returns their numbers."""
    bodies = []
    for x, y, radius in trees.tolist():
        shape = bullet.createCollisionShape(bullet.GEOM_CYLINDER, radius=radius, height=_TREE_HEIGHT)
        place = [x, y, _TREE_HEIGHT / 2 - _BELOW]
        bodies.append(bullet.createMultiBody(0, shape, basePosition=place, useMaximalCoordinates=True))
    return bodies
