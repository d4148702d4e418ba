"""One roll-out of a task: walk, stimulate for a while, and judge the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, unwrap_angles
from pdtui.core.errors import SimulationDiverged
from pdtui.core.outcome import Outcome
from pdtui.core.robot_links_and_state import RobotState
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.lockstep_rollouts import LockstepRollouts, make_lockstep_rollouts
from pdtui.robots.robot import Robot
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict
from pdtui.stimulation.interventions.gait_clock import GaitClock
from pdtui.stimulation.interventions.intervention import Onset

LONGEST_WAIT = 2.0
"""Time for which a task waits for the onset of its behavior, s; one that has not begun by then has failed."""


@dataclass(frozen=True)
class StimulationWithDuration:
    """A stimulation and how long it lasts.

    Attributes:
        stimulation: units and outputs.
        steps: duration in control steps; None for the whole roll-out.
        onset: the moment of the gait at which it begins; None begins at once.
    """

    stimulation: Stimulation = NO_STIMULATION
    steps: int | None = None
    onset: Onset | None = None

    def stimulation_at(self, step: int) -> Stimulation:
        """Return the stimulation of a control step since it began."""
        return self.stimulation if self.steps is None or step < self.steps else NO_STIMULATION


def count_walk_steps(task: Task, seed: int) -> int:
    """Return how many control steps a roll-out of this seed walks before the behavior begins."""
    low, high = task.walk
    return int(np.random.default_rng(seed).integers(low, high + 1))


def judge_stimulations(
    robot: Robot,
    policy: Policy,
    task: Task,
    plans: Sequence[StimulationWithDuration],
    seed: int,
    one_by_one: bool = False,
) -> list[TaskVerdict]:
    """Judge each plan after the same unstimulated walk; if that ends early, every plan has failed.

    Plans without an onset run in lock step where robot and policy offer that, unless they are to run one by
    one, as in a drive, to the last bit.
    """
    options = {"start": task.start} if task.start else None
    observation, _ = robot.reset(seed=seed, options=options)
    policy.reset()
    walked = [robot.read_attributes()]
    for _ in range(count_walk_steps(task, seed)):
        observation, _, ends = robot.step_without_reward(policy.act(observation).action)
        walked.append(robot.read_attributes())
        if ends:
            return [TaskVerdict(False, 0.0, {}) for _ in plans]
    start, state = robot.snapshot(), policy.snapshot()
    plain = [number for number, plan in enumerate(plans) if plan.onset is None and not plan.stimulation.edits]
    lockstep = None if one_by_one else make_lockstep_rollouts(robot, policy, len(plain))
    verdicts = {}
    if lockstep is not None:
        judged = _judge_together(lockstep, start, robot, task, [plans[number] for number in plain], walked)
        verdicts = dict(zip(plain, judged, strict=True))
    for number, plan in enumerate(plans):
        if number not in verdicts:
            robot.restore(start)
            policy.restore(state)
            verdicts[number] = _judge_plan(robot, policy, task, plan, walked)
    return [verdicts[number] for number in range(len(plans))]


def _judge_together(
    lockstep: LockstepRollouts,
    start: RobotState,
    robot: Robot,
    task: Task,
    plans: Sequence[StimulationWithDuration],
    walked: Sequence[Floats],
) -> list[TaskVerdict]:
    """Judge plans without an onset from the same start."""
    lockstep.restore([start] * len(plans))
    values: list[list[Floats]] = [[] for _ in plans]

    def stimulate(step: int, _attributes: Floats) -> Sequence[Stimulation]:
        return [plan.stimulation_at(step) for plan in plans]

    def watch(_step: int, rows: NDArray[np.intp], attributes: Floats) -> None:
        for row in rows.tolist():
            values[row].append(attributes[row].copy())

    outcomes = lockstep.run(stimulate, task.steps, watch)
    before = np.array(walked)
    return [
        _judge_run(robot, task, before, run, outcome) for run, outcome in zip(values, outcomes, strict=True)
    ]


def _judge_plan(
    robot: Robot, policy: Policy, task: Task, plan: StimulationWithDuration, walked: Sequence[Floats]
) -> TaskVerdict:
    """Judge a plan from the control step in which it begins."""
    before = [*walked]
    if plan.onset is not None and not _wait_for_onset(robot, policy, plan.onset, before):
        return TaskVerdict(False, 0.0, {})
    observation, outcome = robot.observe(), None
    values: list[Floats] = []
    for step in range(task.steps):
        acted = policy.act(observation, plan.stimulation_at(step))
        try:
            observation, reached, ends = robot.step_without_reward(acted.action)
        except SimulationDiverged:
            outcome = Outcome.DIVERGED
            break
        values.append(robot.read_attributes())
        outcome = reached or outcome
        if ends:
            break
    return _judge_run(robot, task, np.array(before), values, outcome)


def _judge_run(
    robot: Robot, task: Task, before: Floats, values: Sequence[Floats], outcome: Outcome | None
) -> TaskVerdict:
    rows = np.array(values).reshape(-1, len(robot.attributes))
    smooth = unwrap_angles(rows, robot.attributes)
    return task.judge(TaskRunTrace(robot.attributes, before, smooth, outcome))


def _wait_for_onset(robot: Robot, policy: Policy, onset: Onset, walked: list[Floats]) -> bool:
    """Walk on until a behavior that was armed begins, as in a drive, and return whether it ever does.

    The attributes on the way are added to those that were walked before.
    """
    column, dt = robot.attribute_index(onset.mark.signal), robot.control_dt
    clock, delay = GaitClock(onset.mark, dt), round(onset.delay / dt)
    for row in walked:
        clock.update(float(row[column]))
    observation = robot.observe()
    for _ in range(round(LONGEST_WAIT / dt)):
        if clock.control_steps_until(delay) == 0:
            return True
        try:
            observation, _, ends = robot.step_without_reward(policy.act(observation).action)
        except SimulationDiverged:
            return False
        walked.append(robot.read_attributes())
        clock.update(float(walked[-1][column]))
        if ends:
            return False
    return False
