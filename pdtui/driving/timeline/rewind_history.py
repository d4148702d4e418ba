"""The states that a rewind can return to."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pdtui.core.errors import KeystrokeError
from pdtui.core.robot_links_and_state import RobotState
from pdtui.policies.runtime.recurrent_state import PolicyState
from pdtui.stimulation.latched_behavior import LatchState

STEPS_PER_KEPT_STATE = 10
MAX_KEPT_STATES = 240
"""Two minutes at 20 control steps per second."""


@dataclass(frozen=True)
class DriveState:
    """Everything that a control loop needs to go on from a control step.

    Attributes:
        robot: state of the simulator.
        policy: recurrent state of the network.
        latch: the latched behaviors, and the gait that they follow.
        takeover: values of the controls that the operator has taken over.
        noise: state of the generator of action noise; empty for a deterministic policy.
        episode: number of the episode.
        arrived: whether the robot has arrived in it.
    """

    robot: RobotState
    policy: PolicyState
    latch: LatchState
    takeover: Mapping[str, float]
    noise: Mapping[str, Any]
    episode: int
    arrived: bool


@dataclass(frozen=True)
class _KeptState:
    """A state, the number of steps that led to it, and the state kept before it on the way there."""

    state: DriveState
    age: int
    previous: int | None


class RewindHistory:
    """The latest kept states, by the control step before which they held.

    The step counter never goes back: after a rewind, an earlier state goes on under new step numbers. How far
    back a state lies is therefore counted along the steps that led to the present one.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict[int, _KeptState] = OrderedDict()
        self.position: tuple[int | None, int] = (None, 0)
        """The latest kept state that led to the present one, and how far the step counter is ahead of it."""

    def keep(self, step: int, state: DriveState) -> None:
        """Keep the state before a control step, and forget the oldest one beyond `MAX_KEPT_STATES`."""
        previous, ahead = self.position
        self._kept[step] = _KeptState(state, step - ahead, previous)
        self.position = step, ahead
        while len(self._kept) > MAX_KEPT_STATES:
            self._kept.popitem(last=False)

    def step_before(self, step: int, steps_back: int) -> int | None:
        """Return the step of the latest kept state that is at least `steps_back` older, or None."""
        candidate, ahead = self.position
        while candidate is not None and candidate in self._kept:
            kept = self._kept[candidate]
            if kept.age <= step - ahead - steps_back:
                return candidate
            candidate = kept.previous
        return None

    def return_to(self, target: float, step: int) -> DriveState:
        """Return the state before step `target`, from which the present `step` goes on."""
        wanted = int(target) if math.isfinite(target) else -1
        if wanted not in self._kept:
            known = f"{next(iter(self._kept))}..{next(reversed(self._kept))}" if self._kept else "none yet"
            raise KeystrokeError(
                f"cannot rewind to step {wanted}; kept steps: every {STEPS_PER_KEPT_STATE}th of {known}"
            )
        kept = self._kept[wanted]
        self.position = wanted, step - kept.age
        return kept.state
