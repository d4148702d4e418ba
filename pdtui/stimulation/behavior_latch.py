"""The latched behaviors, and the stimulation that they add up to in each control step."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, attribute_column
from pdtui.core.errors import KeystrokeError
from pdtui.core.step_record import ActiveBehavior
from pdtui.core.units import ADDRESS, NO_STIMULATION, Stimulation, UnitEdit, parse_unit
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.stimulation.interventions.bound_intervention import overwrite_by_layer
from pdtui.stimulation.interventions.gait_clock import GaitClock, GaitMark
from pdtui.stimulation.interventions.unit_edits import EditObservation, ImprintUnits
from pdtui.stimulation.latched_behavior import LatchedBehavior, LatchState
from pdtui.stimulation.pid_magnitude import PidMagnitude
from pdtui.stimulation.stack.behavior_binding import NOT_YET, bind_behavior
from pdtui.stimulation.stack.held_units import HeldUnits
from pdtui.stimulation.stack.stack_entry import StackEntry
from pdtui.stimulation.stimulation_map import StimulationMap


class BehaviorLatch:
    """The state machine that turns latched behaviors into stimulations.

    Args:
        stimulation_map: the behaviors.
        layers: widths of the policy's hidden layers.
        attributes: the robot's attributes.
        dt: duration of a control step, s.
        observation_edits: the edits that the robot offers of its observation.

    Raises:
        PolicyError: a unit of the map does not exist.
        RobotError: the robot has no attribute that a behavior of the map is to hold, or to wait for.
        MapError: the robot has no edit of its observation that an imprint of the map needs.
    """

    def __init__(
        self,
        stimulation_map: StimulationMap,
        layers: tuple[int, ...],
        attributes: tuple[Attribute, ...],
        dt: float,
        observation_edits: tuple[ObservationEdit, ...] = (),
    ) -> None:
        self._map, self._attributes, self._dt, self._layers = stimulation_map, attributes, dt, layers
        self._behaviors = {
            name: bind_behavior(behavior, stimulation_map, layers, attributes, dt, observation_edits)
            for name, behavior in stimulation_map.behaviors.items()
        }
        marks: dict[GaitMark, str] = {}
        for name, behavior in stimulation_map.behaviors.items():
            marks |= dict.fromkeys(behavior.marks(), f"{stimulation_map.source}: behavior '{name}'")
        self._clocks = {mark: GaitClock(mark, dt) for mark in marks}
        self._signals = {
            mark: (True, parse_unit(mark.signal, layers))
            if ADDRESS.fullmatch(mark.signal)
            else (False, attribute_column(mark.signal, attributes, owner))
            for mark, owner in marks.items()
        }
        self._latched: list[LatchedBehavior] = []
        self._activations: NDArray[np.float32] | None = None
        self.held = HeldUnits(layers)
        """Units that the operator holds, whatever the behaviors do."""
        self.commands: dict[str, float] = {}
        """The policy's commands that behaviors set in this control step; updated by `stimulate`."""

    @property
    def active(self) -> tuple[ActiveBehavior, ...]:
        """The latched behaviors in their order, the last deciding, without those that fade or are muted."""
        return tuple(one.view() for one in self._latched if not one.fading and not one.muted)

    @property
    def stack(self) -> tuple[StackEntry, ...]:
        """The latched behaviors in their order, muted ones too, without those that only fade."""
        return tuple(one.layer() for one in self._latched if not one.fading)

    @property
    def is_acting(self) -> bool:
        """Whether any behavior is latched, armed or fading, or a unit is held."""
        return bool(self._latched or self.held.outputs)

    def latch_behavior(self, name: str, attributes: Floats, *, beside: bool = False) -> None:
        """Latch a behavior and end those that may not run beside it. A latched behavior starts again.

        One with an onset is armed: it begins at that moment of the gait.

        In mode ``pid``, the target starts at the present value, and latching a latched behavior ends it.
        If it is latched `beside` the others, none of them ends. A behavior that the map lacks is a
        `KeystrokeError`.
        """
        if name not in self._behaviors:
            known = ", ".join(self._behaviors)
            raise KeystrokeError(f"{self._map.source}: no behavior '{name}'; available: {known}")
        behavior = self._behaviors[name].behavior
        own = [one for one in self._latched if one.behavior.name == name]
        others = [one for one in self._latched if one.behavior.name != name]
        holds = behavior.pid is not None and any(not one.fading for one in own)
        kept: list[LatchedBehavior] = []
        for one in others:
            stays = beside or name in one.behavior.together or one.behavior.name in behavior.together
            kept += [one] if stays else one.let_go(self._dt)
        self._latched = kept
        if holds:
            self._latched += [left for one in own for left in one.let_go(self._dt)]
            return
        latched = self._behaviors[name].copy()
        if behavior.pid is not None:
            wraps = self._attributes[latched.column].wraps
            latched.controller = PidMagnitude(behavior.pid, wraps, self._dt)
            latched.controller.start(float(attributes[latched.column]))
        self._latched.append(latched)

    def clear(self) -> None:
        """Let go of all behaviors and units, so that none is changed once what fades has faded."""
        self._latched = [left for one in self._latched for left in one.let_go(self._dt)]
        self.held.replace({})

    def release_behavior(self, name: str) -> None:
        """Let go of one behavior; one that is not latched is a `KeystrokeError`."""
        place = self._latched.index(own := self._find_latched(name))
        self._latched[place : place + 1] = own.let_go(self._dt)

    def set_muted(self, name: str, *, muted: bool) -> None:
        """Mute a behavior, which stays latched, or not; one that is not latched is a `KeystrokeError`."""
        self._find_latched(name).muted = muted

    def move_behavior(self, name: str, place: float) -> None:
        """Move a behavior to a place of the stack, 0 for the lowest; the last behavior decides on a unit.

        A place beyond the stack means its end; a behavior that is not latched is a `KeystrokeError`.
        """
        own = self._find_latched(name)
        others = [one for one in self._latched if one is not own and not one.fading]
        others.insert(int(min(len(others), max(0.0, place))), own)
        self._latched = [one for one in self._latched if one.fading] + others

    def controller_of(self, name: str) -> PidMagnitude:
        """Return the controller of a latched behavior of mode ``pid``; any other is a `KeystrokeError`."""
        controller = self._find_latched(name).controller
        if controller is None:
            raise KeystrokeError(f"behavior '{name}' holds no target; its mode is fixed")
        return controller

    def set_factor(self, name: str, factor: float) -> None:
        """Set the factor on the magnitudes of a behavior; one that is not latched is a `KeystrokeError`."""
        self._find_latched(name).factor = factor

    def stimulate(self, attributes: Floats) -> Stimulation:
        """Return what this control step does, given the robot's present attributes, shape (J,).

        If two latched behaviors share a unit or a command, the last decides. Call it once per control step,
        also while nothing is latched: it follows the gait.
        """
        self._follow_gait(attributes)
        self.commands = {}
        if not self.is_acting:
            return NO_STIMULATION
        values: dict[int, float] = {}
        edits: list[UnitEdit] = []
        fading: list[EditObservation] = []
        for latched in self._latched:
            if not self._has_begun(latched) or latched.muted:
                continue
            factor = latched.factor
            if latched.controller is not None:
                pid = latched.controller
                factor *= pid.magnitude if latched.fading else pid.update(float(attributes[latched.column]))
            if not latched.fading:  # constants and commands do not fade
                self.commands |= {name: weight * factor for name, weight in latched.behavior.commands.items()}
                own = latched.base | {
                    unit: latched.base.get(unit, 0.0) + weight * factor
                    for unit, weight in latched.weights.items()
                }
                if edits:  # what was latched later comes after the edits of what was latched earlier
                    edits += overwrite_by_layer(own, self._layers)
                else:
                    values |= own
            for one in latched.interventions:
                made = one.make_edits(factor, latched.age, attributes, self._clocks, latched.fade_factor)
                # What fades is not cut off by an imprint of the same units: that begins where it is now.
                edits += [e.after_edits(fading) if isinstance(e, ImprintUnits) else e for e in made]
                if latched.fading:
                    fading += {e.edit_observation: None for e in made if isinstance(e, ImprintUnits)}
        if edits and self.held.outputs:
            edits += overwrite_by_layer(self.held.outputs, self._layers)
        else:
            values |= self.held.outputs
        return Stimulation(tuple(values), tuple(values.values()), tuple(edits))

    def end_step(self, activations: NDArray[np.float32] | None = None) -> None:
        """Count down the periods by one control step, and end the behaviors whose period is over.

        Args:
            activations: what the hidden units put out in the step, for behaviors that follow one of them.
        """
        self._activations = activations
        for latched in self._latched:
            if latched.waiting is None:
                latched.age += not latched.fading
                if latched.remaining is not None:
                    latched.remaining -= 1
        over = [one for one in self._latched if one.remaining == 0]
        faded = [left for one in over if not one.fading for left in one.let_go(self._dt)]
        self._latched = faded + [one for one in self._latched if one.remaining != 0]

    def start_episode(self) -> None:
        """End all behaviors, without fading, let go of all units, and forget the gait."""
        self._latched = []
        self.held.replace({})
        self._clocks = {mark: GaitClock(mark, self._dt) for mark in self._clocks}
        self._activations = None

    def copy_state(self) -> LatchState:
        """Return a copy of the state for `restore_state`."""
        latched = [latched.copy() for latched in self._latched]
        return LatchState(latched, deepcopy(self._clocks), self._activations, dict(self.held.outputs))

    def restore_state(self, state: LatchState) -> None:
        """Restore a state that `copy_state` returned."""
        self._latched = [latched.copy() for latched in state.latched]
        self._clocks, self._activations = deepcopy(state.clocks), state.activations
        self.held.replace(state.held)

    def _follow_gait(self, attributes: Floats) -> None:
        for mark, clock in self._clocks.items():
            is_unit, column = self._signals[mark]
            if not is_unit:
                clock.update(float(attributes[column]))
            elif self._activations is not None:
                clock.update(float(self._activations[column]))

    def _has_begun(self, latched: LatchedBehavior) -> bool:
        """Return whether a behavior acts in this control step, and note how long it still waits."""
        onset = latched.behavior.onset
        if onset is None or latched.waiting is None:
            return True
        left = self._clocks[onset.mark].control_steps_until(round(onset.delay / self._dt))
        latched.waiting = None if left == 0 else NOT_YET if left is None else left
        return latched.waiting is None

    def _find_latched(self, name: str) -> LatchedBehavior:
        for latched in self._latched:
            if latched.behavior.name == name and not latched.fading:
                return latched
        raise KeystrokeError(f"behavior '{name}' is not latched")
