"""One stimulated roll-out from a start state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pdtui.core.attributes import Floats, wrap_angle, wrap_angles
from pdtui.core.errors import SimulationDiverged
from pdtui.core.outcome import Outcome
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.intervention_rollout_plan import ControlStepStimulation, InterventionRolloutPlan
from pdtui.probing.start_states import StartState
from pdtui.robots.robot import Robot
from pdtui.stimulation.pid_magnitude import PidMagnitude
from pdtui.stimulation.stimulation_map import PidGains


@dataclass(frozen=True)
class PidStimulationPlan:
    """A stimulation whose strength a controller sets at each control step.

    Attributes:
        units: units to overwrite, each with its value per unit of the controller's output.
        pid: the controller and the attribute that it holds.
        target: target of the attribute, in its unit.
        relative: whether the target is relative to the attribute's value at the start.
        base: values added to those, in the order of `units`; empty for zeros.
    """

    units: Stimulation
    pid: PidGains
    target: float
    relative: bool
    base: tuple[float, ...] = ()


RolloutPlan = Stimulation | PidStimulationPlan | InterventionRolloutPlan
RolloutJob = tuple[RolloutPlan, int]
"""A plan and the index of its start."""


class RolloutOutcome(NamedTuple):
    """What one roll-out measures.

    Attributes:
        means: mean of each attribute over the measured steps of the episode, shape (J,); for an angle, the
            mean change since the start, unwrapped. NaN if it ended before the measured steps.
        error: mean distance from the target over the measured steps; NaN for a fixed stimulation.
        steps_survived: control steps until the episode ended, or all of them.
        outcome: how the episode ended; None if it did not.
    """

    means: Floats
    error: float
    steps_survived: int
    outcome: Outcome | None


def run_rollout(
    robot: Robot, policy: Policy, start: StartState, plan: RolloutPlan, steps: int, measure_from: int
) -> RolloutOutcome:
    """Run a policy with stimulation from a start state, and measure the later part.

    Robot and policy are restored to the start, bit for bit; the policy acts with its mean action. The steps
    from `measure_from` on are measured.
    """
    robot.restore(start.snapshot)
    policy.restore(start.policy_state)
    observation, before = robot.observe(), robot.read_attributes()
    angles = np.array([attribute.wraps for attribute in robot.attributes])
    turned = np.zeros(len(angles))
    total, counted, errors, steps_survived, outcome = np.zeros(len(angles)), 0, 0.0, 0, None
    controller = StimulationController(plan, robot, before) if isinstance(plan, PidStimulationPlan) else None
    stimulate = _plan_stimulation(plan, controller, robot, policy)
    values = before
    for step in range(steps):
        try:
            action = policy.act(observation, stimulate(step, values)).action
            observation, reached, ends = robot.step_without_reward(action)
        except SimulationDiverged:
            outcome = Outcome.DIVERGED
            break
        values, previous = robot.read_attributes(), values
        steps_survived += 1
        change = values - previous
        turned[angles] += wrap_angles(change[angles])
        if step >= measure_from:
            total += np.where(angles, turned, values)
            counted += 1
            errors += controller.distance(values) if controller is not None else 0.0
        if ends:
            outcome = reached
            break
    means = total / counted if counted else np.full(len(angles), np.nan)
    error = errors / counted if counted and controller is not None else float("nan")
    return RolloutOutcome(means, error, steps_survived, outcome)


def _plan_stimulation(
    plan: RolloutPlan, controller: StimulationController | None, robot: Robot, policy: Policy
) -> ControlStepStimulation:
    if controller is not None:
        return lambda _, values: controller.stimulate(values)
    if isinstance(plan, InterventionRolloutPlan):
        return plan.bind(robot, policy)
    fixed = plan if isinstance(plan, Stimulation) else NO_STIMULATION
    return lambda _step, _values: fixed


class StimulationController:
    """The controller of a plan during one roll-out.

    Args:
        plan: The plan.
        robot: Its robot.
        values: The attributes at the start, shape (J,).
    """

    def __init__(self, plan: PidStimulationPlan, robot: Robot, values: Floats) -> None:
        self._column = robot.attribute_index(plan.pid.attribute)
        self._wraps = robot.attributes[self._column].wraps
        self._units = plan.units
        self._base = plan.base or (0.0,) * len(plan.units.units)
        self._pid = PidMagnitude(plan.pid, self._wraps, robot.control_dt)
        value = float(values[self._column])
        self._pid.start(value)
        self._pid.set_target(value + plan.target if plan.relative else plan.target)

    def stimulate(self, values: Floats) -> Stimulation:
        """Return the stimulation of a control step from the attributes before it, shape (J,)."""
        output = self._pid.update(float(values[self._column]))
        pairs = zip(self._base, self._units.values, strict=True)
        return Stimulation(self._units.units, tuple(base + weight * output for base, weight in pairs))

    def distance(self, values: Floats) -> float:
        """Return how far the attribute is from its target, in its unit."""
        error = self._pid.target - float(values[self._column])
        return abs(wrap_angle(error) if self._wraps else error)
