"""The record of one control step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.scenery import NO_SCENERY, NO_TRAFFIC, Scenery, Traffic
from pdtui.core.units import Stimulation


@dataclass(frozen=True)
class ActiveBehavior:
    """A latched behavior, as the screen shows it and the session records it.

    Attributes:
        name: name of the behavior.
        remaining: control steps until its period ends; None if it lasts until another key is pressed.
        factor: factor by which the operator scaled the map's magnitudes.
        target, value, error, magnitude: state of the controller in mode ``pid``, else None.
    """

    name: str
    remaining: int | None
    factor: float = 1.0
    target: float | None = None
    value: float | None = None
    error: float | None = None
    magnitude: float | None = None


class StepRecord(NamedTuple):
    """One control step, after it was simulated.

    Attributes:
        step: number of the control step; the first is 0.
        episode: number of the episode; the first is 0.
        events: events that were applied before this step.
        behaviors: behaviors that were active in this step.
        stimulation: stimulated units and the values that overwrote their outputs.
        natural: the outputs that those units would have had, in the same order.
        action: action of the policy, shape (A,).
        activations: output of every hidden unit, shape (U,), float32.
        attributes: attributes after the step, shape (J,).
        poses: poses of the bodies after the step, shape (B, 7).
        reward, cost: reward and cost of the step.
        digest: digest of the simulator's state after the step.
        ended: why the episode ended with this step; empty if it did not.
        diverged: whether the simulation diverged, so that it cannot continue.
        finished: whether the robot's task is done; if `ended` is empty, the episode can continue.
        scenery: `Robot.scenery`, the same object in every step of a world.
        fell: whether the episode ended with a fall: neither finished nor out of time.
        traffic: what `Robot.read_traffic` returned after the step. Like the scenery, it is recorded for the
            viewer only, and not read back.
    """

    step: int
    episode: int
    events: tuple[DriveEvent, ...]
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
    scenery: Scenery = NO_SCENERY
    fell: bool = False
    traffic: Traffic = NO_TRAFFIC
