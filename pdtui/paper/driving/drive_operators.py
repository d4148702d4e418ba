"""Who shares control of the car with the policy: nobody, an operator with keys, one with a wheel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

from pdtui.core.drive_events import DriveEvent
from pdtui.core.scenery import Traffic
from pdtui.driving.control_loop import ControlLoop
from pdtui.paper.driving.key_effects import DEFAULT, KeyEffects, driving_behaviors
from pdtui.paper.driving.key_operator import KeyOperator
from pdtui.paper.driving.operator_memory import JudgmentErrors
from pdtui.paper.driving.sight_reader import SightReader
from pdtui.paper.driving.steering_operator import SteeringOperator

SharedControl = Literal["alone", "keys", "takeover", "human only"]
"""Who drives: the policy alone; with an operator that presses keys (the paper's H*); with one that steers
while it takes over (H^n); or that operator without the policy."""


class DriveOperator(Protocol):
    """Operates a drive."""

    def act(self, traffic: Traffic) -> Sequence[DriveEvent]:
        """Return the events before the next control step, with this traffic; call it once per step."""


class NoOperator:
    """Leaves the policy alone."""

    def act(self, traffic: Traffic) -> Sequence[DriveEvent]:
        del traffic
        return ()


class KeyDriveOperator:
    """Presses keys of a drive that has not begun."""

    def __init__(self, loop: ControlLoop, effects: KeyEffects, judgment: JudgmentErrors) -> None:
        self._loop, self._reader = loop, SightReader(loop.robot)
        self._operator = KeyOperator(effects, loop.robot.control_dt, judgment)
        self._behaviors = driving_behaviors(loop.map)

    def act(self, traffic: Traffic) -> Sequence[DriveEvent]:
        step, task = self._loop.step, self._operator.choose_key(self._reader.look(traffic))
        if not task:
            return ()
        if task == DEFAULT:
            return (DriveEvent(step, "default", key=self._loop.map.default_key),)
        behavior = self._behaviors[task]
        return (DriveEvent(step, "behavior", behavior.name, key=behavior.key),)


class WheelDriveOperator:
    """Steers and sets the throttle of a drive that has not begun, all the time or while it takes over."""

    def __init__(self, loop: ControlLoop, judgment: JudgmentErrors, *, always: bool) -> None:
        self._loop, self._reader = loop, SightReader(loop.robot)
        self._operator = SteeringOperator(loop.robot.control_dt, judgment, always=always)

    def act(self, traffic: Traffic) -> Sequence[DriveEvent]:
        step, controls = self._loop.step, self._operator.choose_controls(self._reader.look(traffic))
        if controls is None:
            return (DriveEvent(step, "hand back"),) if self._loop.takeover.values else ()
        return (
            DriveEvent(step, "control", "steering", controls.steering),
            DriveEvent(step, "control", "throttle", controls.throttle),
        )


def make_operator(
    control: SharedControl, loop: ControlLoop, effects: KeyEffects | None, judgment: JudgmentErrors
) -> DriveOperator:
    """Return who operates a drive that has not begun; the keys' effects are needed where it presses keys."""
    if control == "keys":
        assert effects is not None
        return KeyDriveOperator(loop, effects, judgment)
    if control == "alone":
        return NoOperator()
    return WheelDriveOperator(loop, judgment, always=control == "human only")
