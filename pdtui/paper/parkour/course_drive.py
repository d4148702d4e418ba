"""A drive along one parkour course and its score, whoever drives: nobody, a program, or a person."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import events_of_pressed_keys
from pdtui.paper.parkour.course_operator import CourseOperator, CourseView
from pdtui.paper.scored_session import read_attribute, read_scored_session, record_scored_drive
from pdtui.robots.parkour.parkour_run import ParkourRun
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.writer.session_recorder import SessionRecorder

PARKOUR = "parkour"
ATTEMPTS_AT_ONE = 8
"""Attempts at one obstacle after which a drive is over."""
_PASSED, _ATTEMPTS = "obstacles passed", "attempts"


@dataclass(frozen=True)
class CourseScore:
    """The score of one drive, up to the end of the course or the last step, or until it is given up.

    Attributes:
        passed: number of obstacles passed.
        crossed: whether the robot reached the end of the course.
        attempts: number of attempts: one more than it fell, crashed or was put back.
        ends: how attempts ended before the end of the course.
        keys: the keys pressed, in their order.
        pressed_steps: number of control steps before which a key was pressed.
    """

    seed: int
    passed: int
    crossed: bool
    attempts: int
    ends: OutcomeCounts
    steps: int
    keys: tuple[str, ...]
    pressed_steps: int

    @property
    def involvement(self) -> float:
        """Share of control steps before which a key was pressed."""
        return self.pressed_steps / self.steps


def require_parkour_run(loop: ControlLoop) -> ParkourRun:
    """Return the run of a drive on a course; a robot without one is a `RobotError`."""
    run = getattr(loop.robot, PARKOUR, None)
    if not isinstance(run, ParkourRun):
        raise RobotError(f"{loop.robot.name}: expected a robot on a parkour course, found none")
    return run


def look_at_course(loop: ControlLoop) -> CourseView:
    """Return what is to be seen of a drive before its next step."""
    run = require_parkour_run(loop)
    x, y = loop.robot.read_poses()[0, :2].tolist()
    return CourseView(x, y, run.next_obstacle, run.blocks_the_way, run.attempts)


def drive_through_course(
    loop: ControlLoop,
    steps: int,
    operator: CourseOperator | None = None,
    recorder: SessionRecorder | None = None,
    until: Callable[[ParkourRun], bool] = lambda _: False,
) -> tuple[CourseScore, tuple[DriveEvent, ...]]:
    """Drive along the course to its end or the last step, or until it is given up; return score and events.

    Without an operator no key is pressed; the caller closes the recorder.

    Args:
        until: ends the drive earlier; called after each step.
    """
    run = require_parkour_run(loop)
    events: list[DriveEvent] = []
    outcomes: list[Outcome] = []
    done, given_up = 0, False
    passed, before = run.passed, run.attempts
    while done < steps and not given_up:
        key = operator.choose_key(look_at_course(loop)) if operator is not None else ""
        record = loop.advance(events_of_pressed_keys([key] if key else [], loop))
        if recorder is not None:
            recorder.write(record)
        done += 1
        events += record.events
        outcomes += [record.outcome] if record.outcome is not None else []
        if run.crossed or until(run):
            break
        if run.passed > passed:
            passed, before = run.passed, run.attempts
        given_up = run.attempts - before >= ATTEMPTS_AT_ONE
    return _score(loop.seed, run.passed, run.attempts, outcomes, done, events), tuple(events)


def record_course(
    loop: ControlLoop, steps: int, operator: CourseOperator, path: Path, activations: ActivationsKept
) -> CourseScore:
    """Run `drive_through_course` and record it like a person's drive, with a keystroke file beside it.

    Raises:
        SessionError: the session already exists, or cannot be written.
    """

    def drive(recorder: SessionRecorder) -> tuple[CourseScore, tuple[DriveEvent, ...]]:
        return drive_through_course(loop, steps, operator, recorder)

    return record_scored_drive(loop, path, activations, drive)


def read_course_score(path: Path, robot: str, steps: int) -> tuple[CourseScore, str]:
    """Score a recorded drive up to the end of its first course, and return its policy's name, too.

    Raises:
        SessionError: the session cannot be read, is of another robot or start, or was rewound.
    """
    session = read_scored_session(path, robot, [PARKOUR], [_PASSED, _ATTEMPTS])
    info = session.info
    arrived = [step + 1 for step, one in session.outcomes.items() if one is Outcome.ARRIVED]
    end = min([session.steps, steps, *arrived])
    passed, attempts = (read_attribute(session, name)[:end] for name in (_PASSED, _ATTEMPTS))
    # The number of the first attempt at the obstacle that comes after as many.
    first = np.array([attempts[np.searchsorted(passed, number)] for number in passed])
    given_up = np.flatnonzero(attempts - first >= ATTEMPTS_AT_ONE) + 1
    count = int(min([end, *given_up]))
    outcomes = [one for step, one in sorted(session.outcomes.items()) if step < count]
    events = [event for event in session.events if event.step < count]
    last = int(passed[count - 1]), int(attempts[count - 1])
    return _score(info.seed, *last, outcomes, count, events), info.policy


def _score(
    seed: int,
    passed: int,
    attempts: int,
    outcomes: Iterable[Outcome],
    steps: int,
    events: Sequence[DriveEvent],
) -> CourseScore:
    found = list(outcomes)
    pressed = [event for event in events if event.key]
    return CourseScore(
        seed,
        passed,
        Outcome.ARRIVED in found,
        attempts,
        count_outcomes(one for one in found if one is not Outcome.ARRIVED),
        steps,
        tuple(event.key for event in pressed),
        len(np.unique([event.step for event in pressed])),
    )
