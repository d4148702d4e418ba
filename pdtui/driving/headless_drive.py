"""Driving from keystrokes without a screen."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import numpy as np

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import (
    DriveEndedFromOutside,
    KeystrokeError,
    PdtuiError,
    SimulationDiverged,
    format_error_in_one_line,
)
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.keystrokes import interpret_keys
from pdtui.sessions.writer.step_recorder import StepRecorder

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class DriveSummary:
    """The summary of a drive without a screen.

    Attributes:
        steps: number of control steps.
        seconds: simulated time, s.
        outcomes: how episodes ended, and how often.
        cost: sum of the cost of all steps.
        involvement: number of control steps that count as human involvement.
        mean: mean of every attribute, by name.
    """

    steps: int
    seconds: float
    outcomes: OutcomeCounts
    cost: float
    involvement: int
    mean: dict[str, float]


def events_of_pressed_keys(keys: Sequence[str], loop: ControlLoop) -> list[DriveEvent]:
    """Return the events of keys that are pressed before the loop's next step.

    A key that means nothing in the present state raises a `KeystrokeError`.
    """
    events = []
    for key, meaning in zip(keys, interpret_keys(keys, loop), strict=True):
        if isinstance(meaning, str):
            raise KeystrokeError(f"step {loop.step}: key '{key}': {meaning}")
        events.append(meaning)
    return events


def drive_from_keystrokes(
    loop: ControlLoop, presses: Mapping[int, Sequence[str]], steps: int
) -> Iterator[StepRecord]:
    """Yield the records of a drive from keystrokes, as fast as possible.

    Raises:
        KeystrokeError: a key means nothing in the state at its step.
        SimulationDiverged: the simulation cannot go on; the record of the step that says so comes first.
    """
    for _ in range(steps):
        record = loop.advance(events_of_pressed_keys(presses.get(loop.step, ()), loop))
        yield record
        if record.outcome is Outcome.DIVERGED:
            raise SimulationDiverged(f"step {record.step}: {record.ended}")


def end_after(records: Iterator[StepRecord], minutes: float | None) -> Iterator[StepRecord]:
    """Yield records until so much time has passed, or all of them if there is no limit."""
    end = math.inf if minutes is None else time.monotonic() + 60.0 * minutes
    for record in records:
        yield record
        if time.monotonic() >= end:
            return


def run_episode(
    loop: ControlLoop, steps: int, events_before: Callable[[int], Sequence[DriveEvent]] = lambda _: ()
) -> Iterator[StepRecord]:
    """Drive until the episode ends, for at most `steps` control steps, and yield the records.

    `events_before` returns the events before the control step with the given number.
    """
    for _ in range(steps):
        record = loop.advance(events_before(loop.step))
        yield record
        if record.ended:
            return


@contextmanager
def catch_ending_signals() -> Iterator[Callable[[], str]]:
    """Yield a function that names the signal that has come; while none has, it returns an empty string.

    A drive can thus end between two control steps: by default, SIGTERM and SIGHUP would leave a recording
    without its end. Only a program's main thread can catch signals. The handlers are restored at the end.
    """
    signals: list[str] = []

    def note(number: int, _frame: FrameType | None) -> None:
        signals.append(f"ended by {signal.Signals(number).name}")

    before = {number: signal.signal(number, note) for number in ENDING_SIGNALS}
    try:
        yield lambda: signals[0] if signals else ""
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def open_step_recorder(recorder: StepRecorder | None) -> Iterator[Callable[[StepRecord], None]]:
    """Yield a function that records a step, and close the recorder with how the ``with`` block ends."""
    outcome = "stopped"
    try:
        yield (lambda _: None) if recorder is None else recorder.write
        outcome = "finished"
    except Exception as error:
        outcome = str(error) if isinstance(error, PdtuiError) else format_error_in_one_line(error)
        raise
    finally:
        if recorder is not None:
            recorder.close(outcome)


def drive_headless(
    loop: ControlLoop,
    presses: Mapping[int, Sequence[str]],
    steps: int,
    recorder: StepRecorder | None,
    ended: Callable[[], str] = str,
    *,
    progress: Callable[[int, int], None] | None = None,
    minutes: float | None = None,
) -> DriveSummary:
    """Drive from keystrokes without a screen and return a summary.

    Args:
        loop: the drive, before its first step.
        presses: keys by the control step before which they are pressed.
        steps: number of control steps.
        recorder: records every step, and is closed however the drive ends.
        ended: called after each step; returns why to end the drive, or an empty string to go on.
        progress: called with the number of steps done and the total.
        minutes: time after which the drive ends with the steps done so far.

    Raises:
        DriveEnded: `ended` returned a reason.
        PdtuiError: as for `drive_from_keystrokes`; the recording is complete all the same.
    """
    involvement, done, cost = 0, 0, 0.0
    outcomes: list[Outcome] = []
    total = np.zeros(len(loop.robot.attributes))
    with open_step_recorder(recorder) as record_step:
        for record in end_after(drive_from_keystrokes(loop, presses, steps), minutes):
            record_step(record)
            done += 1
            if progress is not None:
                progress(done, steps)
            cost += record.cost
            outcomes += [record.outcome] if record.outcome is not None else []
            involvement += record.involved
            total += record.attributes
            if reason := ended():
                where = "" if recorder is None else f", recorded in {recorder.path}"
                raise DriveEndedFromOutside(f"{reason}: {done} steps{where}")
    means = {
        attribute.name: float(value / max(done, 1))
        for attribute, value in zip(loop.robot.attributes, total, strict=True)
    }
    counts = count_outcomes(outcomes, loop.robot.outcomes)
    return DriveSummary(done, done * loop.robot.control_dt, counts, cost, involvement, means)
