"""Stimulated roll-outs in lock step: one forward pass acts for all of them in each control step."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.core.robot_links_and_state import RobotState
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.batched_policy import BatchedPolicy, make_batched_policy
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.lockstep.lockstep_robots import LockstepRobots
from pdtui.robots.robot import Robot

FEWEST_TOGETHER = 4
"""Fewer roll-outs are faster one after the other."""
ControlStepWatcher = Callable[[int, NDArray[np.intp], Floats], None]
"""Is told the control step, the rows that took it, and the attributes of all rows, shape (n, J)."""


class LockstepRollouts:
    """Copies of a robot and a policy that acts for all of them.

    What comes out is what roll-outs one by one give, to rounding: a forward pass for many rounds differently,
    and a robot that walks makes more of that with every step.

    Args:
        robots: The copies.
        policy: The policy.
    """

    def __init__(self, robots: LockstepRobots, policy: BatchedPolicy) -> None:
        self._robots, self._policy, self._count = robots, policy, 0

    def world_id(self, state: RobotState) -> Hashable:
        """Return what tells the world of a state from others; roll-outs in one world run together."""
        return self._robots.world_id(state)

    def restore(self, starts: Sequence[RobotState]) -> Floats:
        """Bring copies into the states in which roll-outs begin; return their attributes, shape (n, J)."""
        self._count = len(starts)
        for row, start in enumerate(starts):
            self._robots.restore(row, start)
        return self._robots.attributes[: len(starts)].copy()

    def run(
        self, stimulate: Callable[[int, Floats], Sequence[Stimulation]], steps: int, watch: ControlStepWatcher
    ) -> list[Outcome | None]:
        """Run roll-outs from the states that were restored, each until its episode ends or for all steps.

        Args:
            stimulate: Returns the stimulation of each roll-out, from the control step and the attributes,
                shape (n, J). Those of roll-outs that have ended are ignored.
            steps: Number of control steps.
            watch: Is told every control step of those that go on.

        Returns:
            How each episode ended; None for one that went on.
        """
        observations = self._robots.observations[: self._count]
        attributes = self._robots.attributes[: self._count]
        outcomes: list[Outcome | None] = [None] * self._count
        going = list(range(self._count))
        for step in range(steps):
            actions = self._policy.act(observations, stimulate(step, attributes))
            for row, outcome in zip(going, self._robots.step(going, actions[going]), strict=True):
                outcomes[row] = outcome
            # A control step in which the simulation diverges measures nothing.
            moved = [row for row in going if outcomes[row] is not Outcome.DIVERGED]
            watch(step, np.array(moved, np.intp), attributes)
            going = [row for row in going if outcomes[row] is None]
            if not going:
                break
        return outcomes


def make_lockstep_rollouts(robot: Robot, policy: Policy, count: int) -> LockstepRollouts | None:
    """Return what runs up to `count` roll-outs; None if robot or policy cannot, or there are too few."""
    if count < FEWEST_TOGETHER:
        return None
    batched = make_batched_policy(policy)
    robots = None if batched is None else robot.make_lockstep_robots(count)
    return None if batched is None or robots is None else LockstepRollouts(robots, batched)
