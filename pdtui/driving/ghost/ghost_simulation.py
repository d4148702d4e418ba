"""What runs in the ghost's process: a control loop in which no behavior is latched."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import RobotError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.timeline.rewind_history import DriveState

_NICENESS = 5  # the drive goes first where there are not enough processors for both


@dataclass(frozen=True)
class GhostStart:
    """The state in which a ghost begins.

    Attributes:
        step: the control step before which the drive was in that state.
        state: the state, with nothing latched.
        digest: digest of the simulator's state.
        is_other_policy: whether the ghost's policy cannot go on from the state of the drive's.
    """

    step: int
    state: DriveState
    digest: int
    is_other_policy: bool = False


class GhostStepInput(NamedTuple):
    """A control step that the ghost has to do, and those of the drive's events that it follows."""

    step: int
    events: tuple[DriveEvent, ...]


class GhostStepResult(NamedTuple):
    """What is kept of one control step of the ghost.

    Attributes:
        step: number of the control step.
        attributes: attributes after the step, shape (J,).
        poses: poses of the bodies after the step, shape (B, 7).
        digest: digest of the simulator's state after the step.
        ended: why the ghost's episode ended with this step; empty if it did not.
    """

    step: int
    attributes: Floats
    poses: Floats
    digest: int
    ended: str


def build_ghost_loop(config: DriveConfig) -> ControlLoop:
    """Return the loop of a ghost of this drive, in the ghost's process."""
    loop = build_control_loop(config)
    os.nice(_NICENESS)  # not before, or a busy machine would never load it
    return loop


def answer_when_loaded(loop: ControlLoop) -> None:
    """Return once the loop has been built, which says that robot and policy are loaded."""
    del loop


def restore_ghost_start(loop: ControlLoop, start: GhostStart) -> None:
    """Bring a loop into the state of a start; a `RobotError` says that it is not the same to the last bit."""
    loop.step = start.step
    state = start.state
    if start.is_other_policy:
        loop.policy.reset()
        state = replace(state, policy=loop.policy.snapshot())
    loop.restore_state(state)
    if loop.robot.digest() != start.digest:
        raise RobotError(f"{loop.robot.name}: expected the drive's own state to begin with, got another")


def run_ghost(
    loop: ControlLoop, start: GhostStart | None, tasks: Sequence[GhostStepInput]
) -> list[GhostStepResult]:
    """Begin anew if there is a start, then run control steps until all are done or the episode ends.

    Raises:
        RobotError: the robot could not be brought into the state of the start, to the last bit.
    """
    if start is not None:
        restore_ghost_start(loop, start)
    steps: list[GhostStepResult] = []
    for task in tasks:
        record = loop.advance(task.events)
        steps.append(
            GhostStepResult(record.step, record.attributes, record.poses, record.digest, record.ended)
        )
        if record.ended:
            break
    return steps
