"""One run of an evaluation: walk, press, hold, release, and go on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pdtui.core.attributes import Floats, unwrap_angles
from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome, is_failure
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import run_episode
from pdtui.evaluation.behavior_substitutes import (
    BehaviorSubstitute,
    InterventionSize,
    InterventionSizeMeter,
    act_in_place,
)
from pdtui.evaluation.disturbance_conditions import (
    UNDISTURBED,
    DisturbanceCondition,
    disturb_policy,
    disturbed_world,
    plan_pushes,
    push_robot,
)
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.robots.geometry import root_body_row
from pdtui.sessions.writer.session_recorder import SessionRecorder


@dataclass(frozen=True)
class HeldRunPlan:
    """One run.

    Attributes:
        behavior: The behavior that is pressed; empty for the policy alone.
        seed: Seed of the run.
        times: When it is pressed and released.
        condition: How the run is disturbed.
        substitute: What acts in the place of the behavior's units; None for the units.
        observation_spread: Standard deviation of every observation in an undisturbed walk, for noise.
        start: Name of the state in which the run starts; empty for the robot's usual one.
        earlier: Behaviors that are pressed before that, and before which control step.
    """

    behavior: str
    seed: int
    times: RunTimes
    condition: DisturbanceCondition = UNDISTURBED
    substitute: BehaviorSubstitute | None = None
    observation_spread: Floats = field(default_factory=lambda: np.zeros(()))
    start: str = ""
    earlier: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class HeldRunTrace:
    """What is kept of a run: means over bins from the press on, NaN after the end of the episode.

    Attributes:
        values: Attributes, shape (bins, J), angles unwrapped.
        places: Where the first body is at the end of each bin, x and y in m, shape (bins, 2); NaN for a robot
            without poses.
        outcome: How the episode ended, or that its task was done; None if it lasted as long as planned.
        ended_at: Control steps from the press to that end; negative for one before it, None for none.
    """

    values: Floats
    places: Floats
    outcome: Outcome | None = None
    ended_at: int | None = None

    @property
    def failed(self) -> bool:
        """Whether the episode failed."""
        return is_failure(self.outcome)


@contextmanager
def begin_held_run(
    built: ControlLoop, plan: HeldRunPlan
) -> Iterator[tuple[ControlLoop, Iterator[StepRecord]]]:
    """Begin one run; give its loop and, to be driven within the block, its records up to the end."""
    robot, times = built.robot, plan.times
    pushes = plan_pushes(plan.condition, plan.seed, times.dt, times.steps)

    def before_step(step: int) -> Sequence[DriveEvent]:
        push_robot(robot, pushes, step)
        if plan.behavior and step == times.press:
            return [DriveEvent(step, "behavior", plan.behavior)]
        if step == times.press + times.held:
            return [DriveEvent(step, "default")]
        return [DriveEvent(step, "behavior", name) for at, name in plan.earlier if at == step]

    with disturbed_world(robot, plan.condition):
        loop = ControlLoop(robot, built.policy, built.map, plan.seed, start=plan.start)
        act = act_in_place(loop.act, built.policy, robot, plan.substitute)
        loop.act = disturb_policy(act, robot, plan.condition, plan.seed, plan.observation_spread)
        yield loop, run_episode(loop, times.steps, before_step)


def drive_held_run(built: ControlLoop, plan: HeldRunPlan) -> Iterator[StepRecord]:
    """Drive one run and yield its records, up to the end of the episode."""
    with begin_held_run(built, plan) as (_, records):
        yield from records


def run_held_behavior(built: ControlLoop, plan: HeldRunPlan) -> HeldRunTrace:
    """Run once and keep what figures and judges need."""
    times, attributes = plan.times, built.robot.attributes
    rows, places, outcome, ended_at = [], [], None, None
    for record in drive_held_run(built, plan):
        rows.append(record.attributes)
        places.append(record.poses[0, :2] if len(record.poses) else np.full(2, np.nan))
        outcome = record.outcome or outcome
        if record.ended:
            ended_at = record.step - times.press
    smooth = unwrap_angles(np.array(rows), attributes)[times.press :]
    values = np.full((times.bins, len(attributes)), np.nan)
    ends = np.full((times.bins, 2), np.nan)
    for number in range(min(times.bins, len(smooth) // times.bin)):
        part = slice(number * times.bin, (number + 1) * times.bin)
        values[number] = smooth[part].mean(axis=0)
        ends[number] = places[times.press + part.stop - 1]
    return HeldRunTrace(values, ends, outcome, ended_at)


@dataclass(frozen=True)
class InterventionMeasurement:
    """What one measuring run found: the size of the push, if any, and the spread of each observation."""

    size: InterventionSize | None
    observation_spread: Floats


def measure_intervention(built: ControlLoop, plan: HeldRunPlan) -> InterventionMeasurement:
    """Run up to the end of the first window and measure how far the behavior moves units and actions."""
    loop = ControlLoop(built.robot, built.policy, built.map, plan.seed, start=plan.start)
    meter = InterventionSizeMeter(built.policy)
    loop.act = meter.act

    def press(step: int) -> Sequence[DriveEvent]:
        pressed = plan.behavior and step == plan.times.press
        return [DriveEvent(step, "behavior", plan.behavior)] if pressed else []

    for _ in run_episode(loop, plan.times.press + plan.times.window, press):
        pass
    return InterventionMeasurement(meter.size(), np.array(meter.observations).std(axis=0))


def record_held_run(built: ControlLoop, plan: HeldRunPlan, path: Path) -> None:
    """Drive one run and record it as a session.

    Raises:
        SessionError: The file exists, or cannot be written.
    """
    info = ControlLoop(built.robot, built.policy, built.map, plan.seed, start=plan.start).info
    with SessionRecorder(path, info) as recorder:
        for record in drive_held_run(built, plan):
            recorder.write(record)


@dataclass(frozen=True)
class HeldRunFilm:
    """Poses of a run at some times, and its whole way.

    Attributes:
        seconds: Time of each frame from the press on, s; frames after the end are missing.
        poses: Poses of all bodies in each frame, shape (frames, B, 7).
        way: Where the robot is at each control step from the press on, x and y in m, shape (steps, 2).
        held: Control steps from the press to the release.
        outcome: How the episode ended, or that its task was done; None if it lasted as long as planned.
    """

    seconds: tuple[float, ...]
    poses: Floats
    way: Floats
    held: int
    outcome: Outcome | None


def film_held_run(built: ControlLoop, plan: HeldRunPlan, seconds: Sequence[float]) -> HeldRunFilm:
    """Run once more and keep the poses at some times from the press on, s."""
    times, root = plan.times, root_body_row(built.robot.links)
    wanted = {times.press + round(one / times.dt): one for one in seconds}
    taken, poses, way, outcome = [], [], [], None
    for record in drive_held_run(built, plan):
        if record.step in wanted:
            taken.append(wanted[record.step])
            poses.append(record.poses)
        if record.step >= times.press:
            way.append(record.poses[root, :2])
        outcome = record.outcome or outcome
    bodies = np.array(poses).reshape(len(poses), -1, 7)
    return HeldRunFilm(tuple(taken), bodies, np.array(way).reshape(-1, 2), times.held, outcome)
