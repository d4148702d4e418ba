"""The controls that the operator has taken over from the policy, and the action that results."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError, RobotError
from pdtui.core.robot_links_and_state import ManualControl
from pdtui.core.step_record import ReplacedAction
from pdtui.robots.robot import Robot

NO_CONTROLS = "has no controls that an operator can take over"


class ManualTakeover:
    """The state machine that puts the operator's controls in the place of components of the policy's action.

    Args:
        robot: the robot whose `manual_controls` can be taken over.

    Raises:
        RobotError: a control moves a component that the action does not have, or that another one moves.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._dt = robot.name, robot.control_dt
        self._controls = {control.name: control for control in robot.manual_controls}
        self._values: dict[str, float] = {}
        if not self._controls:
            return
        size, owners = math.prod(robot.action_space.shape or (0,)), dict[int, str]()
        for control in robot.manual_controls:
            if not 0 <= control.action < size:
                raise RobotError(
                    f"{robot.name}: control '{control.name}' moves component {control.action} of the action, "
                    f"which has {size}"
                )
            owner = owners.setdefault(control.action, control.name)
            if owner != control.name:
                raise RobotError(
                    f"{robot.name}: controls '{owner}' and '{control.name}' both move component "
                    f"{control.action} of the action"
                )

    @property
    def values(self) -> dict[str, float]:
        """Values of the controls that are taken over, −1..1 each, by name in the robot's order."""
        return {name: self._values[name] for name in self._controls if name in self._values}

    def control_of_arrow(self, key: str) -> ManualControl | None:
        """Return the control that is taken over and that an arrow key changes."""
        arrows = "sideways" if key in ("left", "right") else "lengthways"
        taken = (control for name, control in self._controls.items() if name in self._values)
        return next((control for control in taken if control.arrows == arrows), None)

    def apply_event(self, event: DriveEvent) -> None:
        """Take over all controls, set one, or hand all back; what does not fit is a `KeystrokeError`.

        In a takeover of all controls, those that were not yet taken over start at 0. A control that is set
        is taken over by that.
        """
        if not self._controls:
            raise KeystrokeError(f"step {event.step}: {self._robot} {NO_CONTROLS}")
        if event.kind == "takeover":
            self._values = {name: self._values.get(name, 0.0) for name in self._controls}
        elif event.kind == "hand back":
            if not self._values:
                raise KeystrokeError(f"step {event.step}: no control is taken over that could be handed back")
            self._values = {}
        elif event.name not in self._controls:
            known = ", ".join(self._controls)
            raise KeystrokeError(
                f"step {event.step}: {self._robot} has no manual control '{event.name}'; available: {known}"
            )
        elif not -1.0 <= event.value <= 1.0:
            raise KeystrokeError(
                f"step {event.step}: {event.name}: expected a value from −1 to 1, found {event.value:g}"
            )
        else:
            self._values[event.name] = event.value

    def clear(self) -> None:
        """Hand back what was taken over, if anything was."""
        self._values = {}

    def replace_action(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], tuple[ReplacedAction, ...]]:
        """Return the action that acts, and what it replaced; without a takeover, it is the same array."""
        if not self._values:
            return action, ()
        acting, replaced = action.copy(), []
        for name, value in self.values.items():
            control = self._controls[name]
            acting[control.action] = control.scale * value
            replaced.append(ReplacedAction(control.action, float(action[control.action])))
        return acting, tuple(replaced)

    def end_step(self) -> None:
        """Let the controls that return by themselves go back by one control step."""
        for name, value in self._values.items():
            size = max(0.0, abs(value) - self._controls[name].return_rate * self._dt)
            self._values[name] = math.copysign(size, value)

    def copy_state(self) -> dict[str, float]:
        """Return a copy of the state for `restore_state`."""
        return dict(self._values)

    def restore_state(self, state: Mapping[str, float]) -> None:
        """Restore a state that `copy_state` returned."""
        self._values = dict(state)
