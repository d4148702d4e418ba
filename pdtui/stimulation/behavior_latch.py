"""The latched behaviors, and the stimulation that they add up to in each control step."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace

from pdtui.core.attributes import Attribute, Floats, attribute_column
from pdtui.core.errors import KeystrokeError
from pdtui.core.step_record import ActiveBehavior
from pdtui.core.units import NO_STIMULATION, Stimulation, parse_unit
from pdtui.stimulation.pid_magnitude import PidMagnitude
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap


@dataclass
class _LatchedBehavior:
    behavior: Behavior
    weights: dict[int, float]
    base: dict[int, float]
    column: int  # of the attribute that the controller holds
    remaining: int | None  # control steps
    factor: float = 1.0
    controller: PidMagnitude | None = None

    def copy(self) -> _LatchedBehavior:
        """Copy what changes; behavior and weights never do."""
        return replace(self, controller=deepcopy(self.controller))


class BehaviorLatch:
    """The state machine that turns latched behaviors into stimulations.

    Args:
        stimulation_map: the behaviors.
        layers: widths of the policy's hidden layers.
        attributes: the robot's attributes.
        dt: duration of a control step, s.

    Raises:
        PolicyError: a unit of the map does not exist.
        RobotError: the robot has no attribute that a behavior of the map is to hold.
    """

    def __init__(
        self,
        stimulation_map: StimulationMap,
        layers: tuple[int, ...],
        attributes: tuple[Attribute, ...],
        dt: float,
    ) -> None:
        self._map, self._attributes, self._dt = stimulation_map, attributes, dt
        self._behaviors: dict[str, _LatchedBehavior] = {}
        for name, behavior in stimulation_map.behaviors.items():
            weights, base = (
                {parse_unit(unit, layers): value for unit, value in outputs.items()}
                for outputs in (stimulation_map.units_of(behavior), behavior.base)
            )
            owner = f"{stimulation_map.source}: behavior '{name}'"
            column = (
                0 if behavior.pid is None else attribute_column(behavior.pid.attribute, attributes, owner)
            )
            steps = None if behavior.period is None else max(1, round(behavior.period / dt))
            self._behaviors[name] = _LatchedBehavior(behavior, weights, base, column, steps)
        self._latched: list[_LatchedBehavior] = []
        self.commands: dict[str, float] = {}
        """The policy's commands that behaviors set in this control step; updated by `stimulate`."""

    @property
    def active(self) -> tuple[ActiveBehavior, ...]:
        """The latched behaviors, in the order in which they were latched."""
        return tuple(
            ActiveBehavior(
                one.behavior.name,
                one.remaining,
                one.factor,
                *((pid.target, pid.value, pid.error, pid.magnitude) if (pid := one.controller) else ()),
            )
            for one in self._latched
        )

    def latch_behavior(self, name: str, attributes: Floats) -> None:
        """Latch a behavior and end those that may not run beside it. A latched behavior starts again.

        In mode ``pid``, the target starts at the present value, and latching a latched behavior ends it. A
        behavior that the map lacks is a `KeystrokeError`.
        """
        if name not in self._behaviors:
            known = ", ".join(self._behaviors)
            raise KeystrokeError(f"{self._map.source}: no behavior '{name}'; available: {known}")
        behavior = self._behaviors[name].behavior
        was_on = any(latched.behavior.name == name for latched in self._latched)
        self._latched = [
            latched
            for latched in self._latched
            if latched.behavior.name != name
            and (name in latched.behavior.together or latched.behavior.name in behavior.together)
        ]
        if was_on and behavior.pid is not None:
            return
        latched = self._behaviors[name].copy()
        if behavior.pid is not None:
            wraps = self._attributes[latched.column].wraps
            latched.controller = PidMagnitude(behavior.pid, wraps, self._dt)
            latched.controller.start(float(attributes[latched.column]))
        self._latched.append(latched)

    def clear(self) -> None:
        """End all behaviors, so that no unit is overwritten."""
        self._latched = []

    def set_target(self, name: str, target: float) -> None:
        """Set the target of a latched behavior of mode ``pid``; for any other, raise a `KeystrokeError`."""
        controller = self._find_latched(name).controller
        if controller is None:
            raise KeystrokeError(f"behavior '{name}' holds no target; its mode is fixed")
        controller.set_target(target)

    def set_factor(self, name: str, factor: float) -> None:
        """Set the factor on the magnitudes of a behavior; one that is not latched is a `KeystrokeError`."""
        self._find_latched(name).factor = factor

    def stimulate(self, attributes: Floats) -> Stimulation:
        """Return what this control step overwrites, given the robot's present attributes, shape (J,).

        If two latched behaviors share a unit or a command, the one latched last decides.
        """
        self.commands = {}
        if not self._latched:
            return NO_STIMULATION
        values: dict[int, float] = {}
        for latched in self._latched:
            factor = latched.factor
            if latched.controller is not None:
                factor *= latched.controller.update(float(attributes[latched.column]))
            self.commands |= {name: weight * factor for name, weight in latched.behavior.commands.items()}
            values |= latched.base
            for unit, weight in latched.weights.items():
                values[unit] = latched.base.get(unit, 0.0) + weight * factor
        return Stimulation.of(values)

    def end_step(self) -> None:
        """Count down the periods by one control step, and end the behaviors whose period is over."""
        for latched in self._latched:
            if latched.remaining is not None:
                latched.remaining -= 1
        self._latched = [latched for latched in self._latched if latched.remaining != 0]

    def copy_state(self) -> list[_LatchedBehavior]:
        """Return a copy of the state for `restore_state`."""
        return [latched.copy() for latched in self._latched]

    def restore_state(self, state: list[_LatchedBehavior]) -> None:
        """Restore a state that `copy_state` returned."""
        self._latched = [latched.copy() for latched in state]

    def _find_latched(self, name: str) -> _LatchedBehavior:
        for latched in self._latched:
            if latched.behavior.name == name:
                return latched
        raise KeystrokeError(f"behavior '{name}' is not latched")
