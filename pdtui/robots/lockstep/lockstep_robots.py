"""The interface of copies of one robot, each in a state of its own, that are stepped together."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.core.robot_links_and_state import RobotState


class LockstepRobots(Protocol):
    """N copies of a robot; only those that are asked to take a step.

    They work with the robot itself, which has to be reset or restored before it is used again.

    Attributes:
        observations: What `Robot.observe` returns in the state of each, shape (N, O).
        attributes: What `Robot.read_attributes` returns there, shape (N, J).
    """

    observations: Floats
    attributes: Floats

    def world_id(self, state: RobotState) -> Hashable:
        """Return what tells the world of a state from others: all copies have to be in the same world."""

    def restore(self, row: int, state: RobotState) -> None:
        """Bring one copy into a state that the robot's `snapshot` returned, bit for bit.

        Raises:
            RobotError: The state is of another robot or has another size.
        """

    def step(self, rows: Sequence[int], actions: NDArray[np.float32]) -> list[Outcome | None]:
        """Let some copies take one control step.

        Args:
            rows: Their numbers.
            actions: The action of each of them, shape (len(rows), A).

        Returns:
            How the episode of each of them ended in this step; None if it goes on.
        """
