"""What a latch keeps of each latched behavior."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pdtui.core.step_record import ActiveBehavior
from pdtui.stimulation.interventions.bound_intervention import BoundIntervention
from pdtui.stimulation.interventions.gait_clock import GaitClock, GaitMark
from pdtui.stimulation.pid_magnitude import PidMagnitude
from pdtui.stimulation.stack.stack_entry import PidTuning, StackEntry
from pdtui.stimulation.stimulation_map import Behavior


@dataclass
class LatchedBehavior:
    """A behavior that is latched, armed or fading.

    Attributes:
        behavior: The behavior.
        weights, base: Weights and base outputs by flat index.
        interventions: Its interventions, ready to act.
        column: Column of the attribute that the controller holds.
        remaining: Control steps until it ends; None if it lasts.
        waiting: Control steps until its onset, −1 while that cannot be known; None once it has begun.
        factor: Factor by which the operator scaled it.
        age: Control steps since it began.
        fading: Control steps over which it fades; 0 while it is latched.
        controller: The controller of mode ``pid``.
        muted: Whether it stays latched without acting.
    """

    behavior: Behavior
    weights: dict[int, float]
    base: dict[int, float]
    interventions: tuple[BoundIntervention, ...]
    column: int
    remaining: int | None
    waiting: int | None
    factor: float = 1.0
    age: int = 0
    fading: int = 0
    controller: PidMagnitude | None = None
    muted: bool = False

    @property
    def fade_factor(self) -> float:
        """How much of it is left while it fades."""
        return (self.remaining or 0) / (self.fading + 1) if self.fading else 1.0

    def view(self) -> ActiveBehavior:
        """Return what the screen shows of it, and sessions record."""
        target = value = error = magnitude = None
        if (pid := self.controller) is not None:
            target, value, error, magnitude = pid.target, pid.value, pid.error, pid.magnitude
        return ActiveBehavior(
            self.behavior.name, self.remaining, self.factor, target, value, error, magnitude, self.waiting
        )

    def let_go(self, dt: float) -> list[LatchedBehavior]:
        """Return what is left of it once it is let go: nothing, unless it fades."""
        if self.fading:
            return [self]
        steps = round(self.behavior.fade / dt)
        if not steps or self.waiting is not None or self.muted:
            return []
        return [replace(self, fading=steps, remaining=steps)]

    def layer(self) -> StackEntry:
        """Return its layer of the stack."""
        edited = [unit for one in self.interventions for unit in one.units]
        gains = None if self.controller is None else self.controller.gains
        return StackEntry(
            self.behavior.name,
            self.factor,
            self.muted,
            tuple(dict.fromkeys((*self.base, *self.weights, *edited))),
            None if gains is None else PidTuning(gains.kp, gains.ki, gains.kd, gains.limit),
        )

    def copy(self) -> LatchedBehavior:
        """Copy what changes; behavior, weights and interventions never do."""
        return replace(self, controller=deepcopy(self.controller))


@dataclass(frozen=True)
class LatchState:
    """What a latch needs to go on: the latched behaviors, the gait, the last activations, and held units."""

    latched: list[LatchedBehavior]
    clocks: dict[GaitMark, GaitClock]
    activations: NDArray[np.float32] | None
    held: Mapping[int, float] = field(default_factory=dict)
