"""The actions and pushes since a reset, stored so that a snapshot of them costs nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdtui.core.attributes import Floats
from pdtui.robots.robot import Robot

_NO_PUSHES = np.empty((0, 3))


class ActionLog:
    """An append-only array of actions, so that what `so_far` returned never changes and shares its memory."""

    def __init__(self, width: int) -> None:
        self._rows: Floats = np.empty((64, width))
        self._count = 0
        self._pushes: list[tuple[float, float, float]] = []

    def __len__(self) -> int:
        return self._count

    def append(self, action: ArrayLike) -> None:
        """Append an action, any shape of `width` numbers."""
        if self._count == len(self._rows):
            self._rows = np.concatenate((self._rows, np.empty_like(self._rows)))
        self._rows[self._count] = np.ravel(action)
        self._count += 1

    def append_push(self, vx: float, vy: float) -> None:
        """Append a push before the next action, changes of velocity in m/s."""
        self._pushes.append((self._count, vx, vy))

    def pushes_so_far(self) -> Floats:
        """Return the pushes up to now, shape (P, 3): number of actions before it, changes of vx and vy."""
        return np.array(self._pushes).reshape(-1, 3)

    def so_far(self) -> Floats:
        """Return the actions up to now, shape (steps, width)."""
        return self._rows[: self._count]


def repeat_log(robot: Robot, actions: NDArray[np.float32], pushes: Floats = _NO_PUSHES) -> None:
    """Step a robot with the logged actions, and push it where the log says so."""
    for done in range(len(actions) + 1):
        for vx, vy in pushes[pushes[:, 0] == done, 1:].tolist():
            robot.push_trunk(vx, vy)
        if done < len(actions):
            robot.step(actions[done])
