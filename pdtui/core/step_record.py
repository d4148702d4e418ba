"""The record of one control step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome
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
        waiting: control steps until an armed behavior begins, −1 while that cannot be known; None for one
            that has begun.
    """

    name: str
    remaining: int | None
    factor: float = 1.0
    target: float | None = None
    value: float | None = None
    error: float | None = None
    magnitude: float | None = None
    waiting: int | None = None


class ReplacedAction(NamedTuple):
    """A component of the action that the operator has taken over.

    Attributes:
        component: its index in the action.
        natural: the policy's value, which did not act.
    """

    component: int
    natural: float


Involvement = TypeVar("Involvement", bool, NDArray[np.bool_])


def is_involvement_step(keyed: Involvement, taken_over: Involvement) -> Involvement:
    """Return whether control steps count as human involvement, the paper's measure: one step each.

    Args:
        keyed: whether the operator pressed a key before the step.
        taken_over: whether the operator set a component of the step's action.
    """
    return keyed | taken_over


class StepRecord(NamedTuple):
    """One control step, after it was simulated.

    Attributes:
        step: number of the control step; the first is 0.
        episode: number of the episode; the first is 0.
        events: events that were applied before this step.
        behaviors: behaviors that were active in this step.
        stimulation: stimulated units and the values that overwrote their outputs.
        natural: the outputs that those units would have had, in the same order.
        action: action that the robot was given, shape (A,): the policy's, except for `replaced`.
        activations: output of every hidden unit, shape (U,), float32.
        attributes: attributes after the step, shape (J,).
        poses: poses of the bodies after the step, shape (B, 7).
        reward, cost: reward and cost of the step.
        digest: digest of the simulator's state after the step.
        ended: why the episode ended with this step; empty if it did not.
        scenery: `Robot.scenery`, the same object in every step of a world.
        traffic: what `Robot.read_traffic` returned after the step. Like the scenery, it is recorded for the
            viewer only, and not read back.
        outcome: how it ended; or, if `ended` is empty, that its task is done and it can go on. An episode
            arrives once: one that goes on afterwards and ends without failing is out of time.
        replaced: components of the action that the operator set during a takeover, empty without one.
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
    scenery: Scenery = NO_SCENERY
    traffic: Traffic = NO_TRAFFIC
    outcome: Outcome | None = None
    replaced: tuple[ReplacedAction, ...] = ()

    @property
    def involved(self) -> bool:
        """Whether the step counts as human involvement."""
        return is_involvement_step(any(event.key for event in self.events), bool(self.replaced))
