"""Putting a drive together, and running one without a screen."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.errors import (
    DriveEnded,
    KeystrokeError,
    PdtuiError,
    SimulationDiverged,
    format_error_in_one_line,
)
from pdtui.core.events import Event
from pdtui.core.step_record import StepRecord
from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.keystrokes import interpret_keys
from pdtui.sessions.writer.session_recorder import SessionRecorder


@dataclass(frozen=True)
class DriveSummary:
    """How a drive without a screen went.

    Attributes:
        steps: control steps.
        seconds: simulated time, s.
        falls: episodes that ended with a fall.
        involvement: control steps in which a key was pressed.
        mean: mean of every attribute, by name.
    """

    steps: int
    seconds: float
    falls: int
    involvement: int
    mean: dict[str, float]


def key_events(keys: Sequence[str], loop: ControlLoop) -> list[Event]:
    """The events of keys pressed before the loop's next step.

    Raises:
        EventError: a key means nothing in the present state.
    """
    events = []
    for key, meaning in zip(keys, interpret_keys(keys, loop), strict=True):
        if isinstance(meaning, str):
            raise KeystrokeError(f"step {loop.step}: key '{key}': {meaning}")
        events.append(meaning)
    return events


def drive_keys(loop: ControlLoop, presses: Mapping[int, Sequence[str]], steps: int) -> Iterator[StepRecord]:
    """Drive from keystrokes, unpaced.

    Keys of one step are read in their order: what the second means depends on what the first did.

    Raises:
        EventError: a key means nothing in the state it meets.
        SimulationDiverged: after the record of the step that diverged.
    """
    for _ in range(steps):
        record = loop.advance(key_events(presses.get(loop.step, ()), loop))
        yield record
        if record.diverged:
            raise SimulationDiverged(f"step {record.step}: {record.ended}")


def run_episode(
    loop: ControlLoop, steps: int, events_before: Callable[[int], Sequence[Event]] = lambda _: ()
) -> Iterator[StepRecord]:
    """Drive from the loop's present step until the episode ends, and at most so many steps.

    Args:
        loop: the drive.
        steps: control steps at most.
        events_before: given the number of a control step, returns the events before it.
    """
    for _ in range(steps):
        record = loop.advance(events_before(loop.step))
        yield record
        if record.ended:
            return


def drive_headless(
    loop: ControlLoop,
    presses: Mapping[int, Sequence[str]],
    steps: int,
    recorder: SessionRecorder | None,
    ended: Callable[[], str] = str,
) -> DriveSummary:
    """Drive from keystrokes without a screen, recording if a recorder is given, and sum it up.

    Args:
        loop: the drive, before its first step.
        presses: keys by the control step before which they are pressed.
        steps: control steps.
        recorder: takes every step; it is closed at the end, however that comes.
        ended: asked after each step; why to end there, empty to go on.

    Raises:
        DriveEnded: `ended` said so.
        PdtuiError: as `drive_keys`; the recording is whole all the same.
    """
    falls = involvement = done = 0
    total = np.zeros(len(loop.robot.attributes))
    outcome = "stopped"
    try:
        for record in drive_keys(loop, presses, steps):
            if recorder is not None:
                recorder.write(record)
            done += 1
            falls += record.fell
            involvement += any(event.key for event in record.events)
            total += record.attributes
            if reason := ended():
                raise DriveEnded(f"{reason}: {done} steps{_recorded(recorder)}")
        outcome = "finished"
    except Exception as error:
        outcome = str(error) if isinstance(error, PdtuiError) else format_error_in_one_line(error)
        raise
    finally:
        if recorder is not None:
            recorder.close(outcome)
    means = {
        attribute.name: float(value / max(done, 1))
        for attribute, value in zip(loop.robot.attributes, total, strict=True)
    }
    return DriveSummary(done, done * loop.robot.control_dt, falls, involvement, means)


def _recorded(recorder: SessionRecorder | None) -> str:
    return "" if recorder is None else f", recorded in {recorder.path}"
