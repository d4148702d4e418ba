"""The control loop, a function of robot, policy, map, seed and events that knows no clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError, SimulationDiverged
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.core.units import Stimulation
from pdtui.driving.manual_takeover import ManualTakeover
from pdtui.driving.timeline.rewind_history import STEPS_PER_KEPT_STATE, DriveState, RewindHistory
from pdtui.policies.runtime.policy import Policy, PolicyStep
from pdtui.robots.robot import Robot
from pdtui.sessions.drive_info import DriveInfo
from pdtui.stimulation.behavior_latch import BehaviorLatch
from pdtui.stimulation.stack.latch_events import apply_latch_event
from pdtui.stimulation.stimulation_map import StimulationMap

PolicyAct = Callable[[NDArray[Any], Stimulation, np.random.Generator | None], PolicyStep]
"""Acts as `Policy.act` does."""


class ControlLoop:
    """Runs a drive one control step at a time.

    Args:
        robot: the robot; the loop resets it.
        policy: the network that acts.
        stimulation_map: the behaviors that events may latch.
        seed: seed of the robot's first reset and of the action noise.
        stochastic: draw actions from the policy's distribution instead of taking its mean.
        start: name of the state in which episodes start; empty for the robot's default.

    Raises:
        PdtuiError: map and robot do not fit: a unit, a command, the start, or a manual control.
    """

    def __init__(
        self,
        robot: Robot,
        policy: Policy,
        stimulation_map: StimulationMap,
        seed: int,
        *,
        stochastic: bool = False,
        start: str = "",
    ) -> None:
        stimulation_map.check_commands(robot.name, robot.commands)
        self.robot, self.policy, self.map, self.seed = robot, policy, stimulation_map, seed
        self.start = robot.check_start(start)
        self._options = {"start": self.start} if self.start else None
        self.step = 0
        self.episode = 0
        self.latch = BehaviorLatch(
            stimulation_map, policy.layers, robot.attributes, robot.control_dt, robot.observation_edits
        )
        self.takeover = ManualTakeover(robot)
        self.act: PolicyAct = policy.act
        """What acts in each control step; an evaluation may put a disturbed policy in its place."""
        self.before_step: Callable[[Sequence[DriveEvent]], None] = lambda _: None
        """Called in each control step with its events, which have been applied, before it is simulated."""
        self._noise = np.random.default_rng(seed) if stochastic else None
        self._ended = self._arrived = self._begun = False
        self._applied: list[DriveEvent] = []
        self.history = RewindHistory()
        self._observation, _ = robot.reset(seed=seed, options=self._options)
        policy.reset()
        self.attributes: Floats = robot.read_attributes()

    @property
    def info(self) -> DriveInfo:
        """Everything that determines this run, besides its events."""
        return DriveInfo(
            robot=self.robot.name,
            seed=self.seed,
            policy=self.policy.name,
            policy_hash=self.policy.sha256,
            map_text=self.map.text,
            stochastic=self._noise is not None,
            start=self.start,
            dt=self.robot.control_dt,
            attributes=self.robot.attributes,
            links=self.robot.links,
            layers=self.policy.layers,
            # On a road, a step costs something also where nothing is hit.
            obstacles=len(self.robot.scenery.cylinders) > 0 and not self.robot.scenery.lines,
            roads=bool(self.robot.scenery.lines),
            robot_options=dict(self.robot.build_options),
        )

    def advance(self, events: Sequence[DriveEvent] = ()) -> StepRecord:
        """Apply the events, then run one control step.

        If the previous step ended the episode, the next episode starts first. After a record that says that
        the simulation diverged, the loop cannot go on. An event that does not fit the map or the present
        state raises a `KeystrokeError`.
        """
        self.apply_events(events)
        events, self._applied, self._begun = tuple(self._applied), [], False
        self.before_step(events)
        stimulation = self.latch.stimulate(self.attributes)
        if self.robot.set_commands({**self.robot.commands, **self.latch.commands}):
            self._observation = self.robot.observe()
        behaviors = self.latch.active
        acted = self.act(self._observation, stimulation, self._noise)
        action, replaced = self.takeover.replace_action(acted.action)
        ended, reward, cost, outcome = "", 0.0, 0.0, None
        try:
            self._observation, gained, terminated, truncated, details = self.robot.step(action)
            reward, cost = float(gained), float(details["cost"])
            outcome = self.robot.outcome_of(terminated, truncated, details)
            if terminated or truncated:
                ended = str(details.get("reason", "the episode is over"))
        except SimulationDiverged as error:
            outcome, ended = Outcome.DIVERGED, str(error)
        if outcome is Outcome.ARRIVED and self._arrived:  # it was said before
            outcome = Outcome.OUT_OF_TIME if ended else None
        self.attributes = self.robot.read_attributes()
        record = StepRecord(
            self.step,
            self.episode,
            events,
            behaviors,
            acted.stimulation,
            acted.natural,
            action,
            acted.activations,
            self.attributes,
            self.robot.read_poses(),
            reward,
            cost,
            self.robot.digest(),
            ended,
            self.robot.scenery,
            self.robot.read_traffic(),
            outcome,
            replaced,
        )
        self.step += 1
        self.latch.end_step(acted.activations)
        self.takeover.end_step()
        self._ended, self._arrived = bool(ended), self._arrived or outcome is Outcome.ARRIVED
        return record

    def apply_events(self, events: Sequence[DriveEvent]) -> None:
        """Apply events that come before the next control step at once, while a drive is paused.

        `advance` need not be given them again; the record of the step has them. Errors are as in `advance`.
        """
        if not self._begun:
            self._begun = True
            if self._ended:
                self._start_episode()
            if self.step % STEPS_PER_KEPT_STATE == 0:
                self.history.keep(self.step, self.copy_state())
        for event in events:
            if event.step != self.step:
                raise KeystrokeError(f"event for step {event.step} given to step {self.step}")
            self._apply(event)
            self._applied.append(event)

    def _apply(self, event: DriveEvent, *, rehearsing: bool = False) -> None:
        """Apply an event; while rehearsing, only to latch, takeover and position in the rewind history."""
        match event.kind:
            case "default":
                self._clear()
            case "takeover" | "control" | "hand back":
                self.takeover.apply_event(event)
            case "reset" if rehearsing:
                self._clear()
            case "reset":
                self._start_episode()
            case "rewind" if rehearsing:
                state = self.history.return_to(event.value, self.step)
                self.latch.restore_state(state.latch)
                self.takeover.restore_state(state.takeover)
            case "rewind":
                self.restore_state(self.history.return_to(event.value, self.step))
            case _:
                apply_latch_event(self.latch, event, self.attributes)

    @contextmanager
    def rehearsal(self) -> Iterator[Callable[[DriveEvent], None]]:
        """Yield a function that applies an event to latch and takeover; at the end, all is undone.

        It shows what a key means after other keys that were pressed before the same step.
        """
        latch, takeover = self.latch.copy_state(), self.takeover.copy_state()
        position = self.history.position
        if self._ended:
            self._clear()  # the next step begins an episode
        try:
            yield partial(self._apply, rehearsing=True)
        finally:
            self.latch.restore_state(latch)
            self.takeover.restore_state(takeover)
            self.history.position = position

    def _start_episode(self) -> None:
        self._observation, _ = self.robot.reset(options=self._options)
        self.policy.reset()
        self.attributes = self.robot.read_attributes()
        self.latch.start_episode()
        self.takeover.clear()
        self.episode += 1
        self._ended = self._arrived = False

    def _clear(self) -> None:
        self.latch.clear()
        self.takeover.clear()

    def copy_state(self) -> DriveState:
        """Return everything that the loop needs to go on from the present step."""
        return DriveState(
            self.robot.snapshot(),
            self.policy.snapshot(),
            self.latch.copy_state(),
            self.takeover.copy_state(),
            self._noise.bit_generator.state if self._noise is not None else {},
            self.episode,
            self._arrived,
        )

    def restore_state(self, state: DriveState) -> None:
        """Go on from a state that `copy_state` returned, at the present step."""
        self.robot.restore(state.robot)
        self.policy.restore(state.policy)
        self.latch.restore_state(state.latch)
        self.takeover.restore_state(state.takeover)
        if self._noise is not None:
            self._noise.bit_generator.state = state.noise
        self.episode = state.episode
        self._observation = self.robot.observe()
        self.attributes = self.robot.read_attributes()
        self._ended, self._arrived = False, state.arrived
