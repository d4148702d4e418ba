"""What one control step leaves behind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.events import Event
from pdtui.core.robot_data import NO_OBSTACLES
from pdtui.core.units import Stimulation


@dataclass(frozen=True)
class ActiveBehavior:
    """A latched behavior as the screen and the session see it.

    Attributes:
        name: of the behavior.
        remaining: control steps until its period ends; None lasts until another key.
        factor: by how much the operator scaled the map's magnitudes.
        target, value, error, magnitude: of the controller in mode ``pid``, else None.
    """

    name: str
    remaining: int | None
    factor: float = 1.0
    target: float | None = None
    value: float | None = None
    error: float | None = None
    magnitude: float | None = None


class StepRecord(NamedTuple):
    """One control step, after it happened.

    Attributes:
        step: number of the control step; the first is 0.
        episode: number of the episode; the first is 0.
        events: applied before this step.
        behaviors: active in this step.
        stimulation: units and the outputs that overwrote them.
        natural: what those units would have put out, in the same order.
        action: shape (A,).
        activations: every hidden unit, shape (U,), float32.
        attributes: after the step, shape (J,).
        poses: body poses after the step, shape (B, 7).
        reward, cost: of the step.
        digest: of the simulator's state after the step.
        ended: why the episode ended with this step, empty if it did not.
        diverged: whether the simulation cannot go on.
        finished: whether the robot's task is done; where `ended` is empty, the robot can go on.
        obstacles: in the robot's way, as `Robot.obstacles`, shape (N, 3): the same array in every step of a
            world, which is not recorded.
        fell: whether the episode ended with a fall: neither finished nor out of time.
    """

    step: int
    episode: int
    events: tuple[Event, ...]
    behaviors: tuple[ActiveBehavior, ...]
    stimulation: Stimulation
    natural: tuple[float, ...]
    action: NDArray[np.float32]
    activations: NDArray[np.float32]
    attributes: Floats
    poses: Floats
    reward: float
    cost: float
    digest: int
    ended: str = ""
    diverged: bool = False
    finished: bool = False
    obstacles: Floats = NO_OBSTACLES
    fell: bool = False
